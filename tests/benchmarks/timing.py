"""Medians of alternated runs."""

import time

import numpy as np


def alternate(candidates, runs=11):
    """Median seconds of each named function, called in turn `runs` times after a warm-up."""
    for run in candidates.values():
        run()
    seconds = {name: [] for name in candidates}
    for _ in range(runs):
        for name, run in candidates.items():
            start = time.perf_counter()
            run()
            seconds[name].append(time.perf_counter() - start)
    return {name: float(np.median(times)) for name, times in seconds.items()}
