"""Objectives and their gradients through the whole simulation."""
