"""Mutated files through the entire command line: frames with finite values, or a refusal in one line."""

import pytest
from command import wfluid
from fuzz_mutations import mutated_files

from wfluid.pictures.stills import read_picture

RUN = ("--cells", 16, "--duration", 0.1, "--fps", 10, "--quiet")
PUSH = ("--push", "10,20:3,0:radius=8")
MOVE = ("--move", "10,20:12,20")

COMMANDS = (
    lambda file: ("animate", file, *PUSH),
    lambda file: ("animate", "plain.png", *PUSH, "--layer", file),
    lambda file: ("animate", "plain.png", *PUSH, "--effect-mask", file),
    lambda file: ("animate", "plain.png", *PUSH, "--freeze", file),
    lambda file: ("animate", "plain.png", *PUSH, "--viscosity-image", file),
    lambda file: ("animate", "plain.png", "--force-image", f"{file}:along=vectors"),
    lambda file: ("morph", "plain.png", file, *MOVE, "--dry-run"),
)
TEXTS = {
    ".csv": lambda file: ("keyframes", "plain.png", "--points", file, "--dry-run"),
    ".toml": lambda file: ("render", file, "--dry-run"),
}


@pytest.mark.parametrize("start", [0, 53])
def test_a_command_with_a_mutated_file_writes_or_refuses(tmp_path, monkeypatch, start):
    monkeypatch.chdir(tmp_path)
    codes = []
    for n, path in enumerate(mutated_files(tmp_path, 53, start)):
        command = TEXTS.get(path.suffix, COMMANDS[n % len(COMMANDS)])(path.name)
        run = () if path.suffix == ".toml" else RUN
        ended = wfluid(*command, *run, "-o", "frame.###.exr")
        codes.append(ended.returncode)
        lines = ended.stderr.splitlines()
        said = [command, ended]
        assert ended.returncode in (0, 2), said
        assert "Traceback" not in ended.stderr, said
        if ended.returncode:
            assert len(lines) == 1 and lines[0].startswith(f"wfluid {command[0]}: "), said
            assert not ended.stdout, said
            continue
        assert all(line.startswith("wfluid: ") for line in lines), said
        for frame in tmp_path.glob("frame.*.exr"):
            read_picture(frame, exact=True)  # refuses what is not finite
            frame.unlink()
    assert {0, 2} == set(codes)
