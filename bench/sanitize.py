"""The only place that prints, beside the console of tables: no control characters of foreign text, no error for a
closed pipe.
"""

from __future__ import annotations

import os
import sys
from typing import IO

import click

CONTROLS = dict.fromkeys(code for code in (*range(32), *range(127, 160)) if chr(code) not in "\n\t")
SPOKEN = {code: None for code in CONTROLS if chr(code) != "\r"}


def plain(text: str) -> str:
    """The text without control characters, which could recolour or overwrite a terminal."""
    return text if text.isprintable() else text.translate(CONTROLS)


def echo(text: str, err: bool = False, nl: bool = True) -> None:
    """Print a text, plain."""
    click.echo(plain(text), err=err, nl=nl)


def echo_styled(text: str) -> None:
    """Print what a console has rendered: its styles are control characters, those of its texts are gone."""
    click.echo(text, nl=False)


def overwrite(text: str) -> None:
    """Print over the last line of a terminal."""
    click.echo(f"\r\x1b[K{plain(text)}", nl=False, err=True)


def pass_on(output: bytes) -> None:
    """Print what another process has written to its stderr, which may overwrite its own line."""
    sys.stderr.write(output.decode(errors="backslashreplace").translate(SPOKEN))
    sys.stderr.flush()


def unread(stream: IO[str]) -> None:
    """Discard further output of a stream whose reader has gone, so that results can still be stored."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)
