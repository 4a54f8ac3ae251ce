"""The asserts of all tests rewritten by two processes, before workers start of which each would rewrite all."""

from __future__ import annotations

from collections.abc import Iterable
from multiprocessing import get_context
from pathlib import Path

import pytest
from _pytest.assertion import rewrite


def rewrite_all(config: pytest.Config, folder: Path) -> None:
    """Into the files in which pytest looks for them, also where Python is to write no bytecode."""
    files, fork = sorted(folder.rglob("test_*.py")), get_context("fork")
    processes = [fork.Process(target=_rewrite, args=(config, part)) for part in (files[::2], files[1::2])]
    for process in processes:
        process.start()
    for process in processes:
        process.join()


def _rewrite(config: pytest.Config, files: Iterable[Path]) -> None:
    for file in files:
        kept = rewrite.get_cache_dir(file) / f"{file.stem}{rewrite.PYC_TAIL}"
        if rewrite.try_makedirs(kept.parent) and rewrite._read_pyc(file, kept) is None:
            told, code = rewrite._rewrite_test(file, config)
            rewrite._write_pyc(config.stash[rewrite.assertstate_key], code, told, kept)
