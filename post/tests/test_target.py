"""Where a command writes: what a killed one left of a file goes with the next that writes it, alone in the folder."""

import subprocess
import sys
from pathlib import Path

from razy.target import replacing, write_text

HOLD = """
import sys
from pathlib import Path
from razy.target import replacing
with replacing(Path(sys.argv[1])) as partial:
    partial.write_text("half")
    print(partial, flush=True)
    sys.stdin.read()
"""


def hold(path: Path) -> tuple[subprocess.Popen, Path]:
    """Return a process that has written half of a file, and what it wrote to."""
    writer = subprocess.Popen([sys.executable, "-c", HOLD, path], stdin=-1, stdout=-1, text=True)
    return writer, Path(writer.stdout.readline().strip())


def kill(writer: subprocess.Popen) -> None:
    writer.kill()
    writer.communicate()


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_what_a_killed_writer_left_goes_with_the_next(tmp_path):
    one, left = hold(tmp_path / "table.csv")
    two, alive = hold(tmp_path / "other.csv")
    kill(one)
    assert names(tmp_path) == {left.name, alive.name} and left.name.startswith(".table.")
    # The other is at work in this folder, so nobody is alone.
    write_text(tmp_path / "table.csv", "whole")
    assert names(tmp_path) == {left.name, alive.name, "table.csv"}
    kill(two)
    write_text(tmp_path / "table.csv", "whole")
    assert names(tmp_path) == {alive.name, "table.csv"}
    with replacing(tmp_path / "other.csv") as partial:
        partial.write_text("whole")
        assert names(tmp_path) == {partial.name, "table.csv"}
    assert names(tmp_path) == {"table.csv", "other.csv"}


def test_files_of_others_stay(tmp_path):
    other = {
        ".table.csv",
        ".table.partial.csv",
        ".table.12x.partial.csv",
        ".table.12.partial.h5",
        ".tables.12.partial.csv",
    }
    for name in other:
        (tmp_path / name).touch()
    write_text(tmp_path / "table.csv", "whole")
    assert names(tmp_path) == other | {"table.csv"}
