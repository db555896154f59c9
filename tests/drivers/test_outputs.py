"""No output destroys anything: not what the command reads, nor another of its files, nor what is no file."""

import os
import signal
import subprocess
import sys
from pathlib import Path
from resource import RLIMIT_FSIZE, prlimit, setrlimit

import pytest
from faults import CHECKPOINT, Sweep, kill_all, wait_for
from programs import GEAR_PAIR, PATIENCE, SOURCE, call, command, left, sets, start, succeed

SHORT = sets(motion__t_end=0.02, record__from=0.01, sweep__step=400)


@pytest.fixture(params=["razy-run", "razy-sweep", "razy-modes"])
def program(request):
    return request.param


@pytest.fixture
def case():
    path = Path("case.nml")
    path.write_text(GEAR_PAIR.read_text())
    return path


def refused(done, *words, exit_code=2):
    assert done.returncode == exit_code, done.stderr
    assert len(done.stderr.splitlines()) == 1
    for word in words:
        assert word in done.stderr


@pytest.mark.parametrize("name", ["case.nml", "./case.nml", "../same/case.nml"])
def test_the_input_is_not_the_output(program, case, name, tmp_path):
    Path("../same").symlink_to(tmp_path)
    try:
        before = case.read_text()
        refused(start(program, case, *SHORT, "--force", "--output", name), "case.nml")
        assert case.read_text() == before
    finally:
        Path("../same").unlink()


def test_what_is_no_file_is_not_replaced(program, case):
    os.mkfifo("pipe")
    Path("link").symlink_to("case.nml")
    Path("dangling").symlink_to("nothing")
    for name in ("pipe", "link", "dangling", "/dev/null"):
        for force in ([], ["--force"]):
            refused(start(program, case, *SHORT, *force, "--output", name, timeout=20), name)
    assert Path("pipe").is_fifo() and Path("link").is_symlink() and Path("dangling").is_symlink()
    assert Path("/dev/null").is_char_device()
    assert left() == ["case.nml", "dangling", "link", "pipe"]


@pytest.mark.parametrize("log", ["case.nml", "case.h5", "./case.h5.checkpoint"])
def test_the_log_is_a_file_of_its_own(case, log):
    before = case.read_text()
    refused(start("razy-sweep", case, *SHORT, "--log", log), "needs for something else")
    assert case.read_text() == before and left() == ["case.nml"]


def test_a_name_that_leaves_no_room_is_refused_at_once(program, case):
    refused(start(program, case, *sets(motion__t_end=1e9), "--output", "n" * 245, timeout=20), "244 characters")
    succeed(program, case, *SHORT, "--output", "n" * 244)


def test_what_killed_runs_left_of_this_sweep_goes_with_them():
    sweep = Sweep(GEAR_PAIR, *sets(sweep__step=8, motion__t_end=0.9))
    kill_all(sweep.begin(40000))
    for name in ("case.h5.partial", "case.h5.2.partial", "other.h5.partial"):
        Path(name).write_text("unfinished")
    assert sweep.start().returncode == 0
    sweep.expect_whole()
    assert CHECKPOINT not in left() and left() == ["case.h5", "log", "other.h5.partial", "whole.h5"]


def test_no_program_overwrites_what_another_made(program, case):
    """All name their results after the input."""
    other = "razy-modes" if program == "razy-run" else "razy-run"
    succeed(other, case, *SHORT)
    before = Path("case.h5").read_bytes()
    for force in ([], ["--force"]):
        done = start(program, case, *SHORT, *force)
        refused(done, f"case.h5: is a result of {other}, which {program} does not overwrite")
    assert Path("case.h5").read_bytes() == before
    Path("case.h5").write_text("precious")
    refused(start(program, case, *SHORT, "--force"), "case.h5: is no result of razy")
    assert Path("case.h5").read_text() == "precious"
    Path("case.h5").unlink()
    succeed(program, case, *SHORT)
    refused(start(program, case, *SHORT), "case.h5: exists already; --force overwrites it")
    succeed(program, case, *SHORT, "--force")


WRITERS = {
    "razy-run": ("torsional_gear_pair", SHORT),
    "razy-modes": ("test_gearbox", []),
    "razy-tune": ("vibropress_vertical", []),
    "razy-duel": ("belt_duel", []),
}


def expect_one_line(done, said):
    assert done.returncode == 1 and said.count("File too large") == 1, said
    assert "Backtrace" not in said and "SIGXFSZ" not in said


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGUSR1])
def test_a_signal_while_the_result_is_written_waits(number):
    long = sets(**{"motion__t_end": 4, "record(1)__interval": 2e-6})
    words = command("razy-run", SOURCE / "inputs" / "two_sided_stop.nml", *long, "--output", "case.h5")
    with subprocess.Popen(words, stderr=subprocess.DEVNULL) as process:
        wait_for(lambda: Path("case.h5.partial").exists(), "no file is written")
        process.send_signal(number)
        assert process.wait(timeout=PATIENCE) == 0
    assert left() == ["case.h5"]


@pytest.mark.parametrize("size", [0, 1000, 5000])
@pytest.mark.parametrize("writer", WRITERS)
def test_a_limit_of_file_size_is_one_line_and_leaves_nothing(writer, size):
    name, short = WRITERS[writer]
    words = command(writer, SOURCE / "inputs" / f"{name}.nml", *short, "--output", "case.h5")
    done = subprocess.run(
        words, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=PATIENCE,
        preexec_fn=lambda: setrlimit(RLIMIT_FSIZE, (size, size)),
    )  # fmt: skip
    expect_one_line(done, done.stderr)
    assert left() == []


RANKS = {
    "razy-sweep": ("torsional_gear_pair", sets(sweep__step=8, motion__t_end=0.9)),
    "razy-follow": ("impact_oscillator", sets(follow__motions="'all'", follow__last=2.3)),
}


@pytest.mark.parametrize("size", [4000, 40000])
@pytest.mark.parametrize("writer", RANKS)
def test_a_limit_of_file_size_leaves_the_checkpoint_of_ranks(writer, size):
    """MPI itself does not begin without files of some MB: the limit comes when the checkpoint is there."""
    name, short = RANKS[writer]
    words = command(writer, SOURCE / "inputs" / f"{name}.nml", *short, "--output", "case.h5")
    with Path("log").open("w+") as log:
        process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        wait_for(lambda: Path(CHECKPOINT).exists(), "no checkpoint is written")
        prlimit(process.pid, RLIMIT_FSIZE, (size, size))
        process.wait(timeout=PATIENCE)
        log.seek(0)
        expect_one_line(process, log.read())
    assert left() == [CHECKPOINT, "log"]
    succeed(writer, *words[1:])
    assert left() == ["case.h5", "log"]


TOOLS = {
    "razy-csv": ("tools.cli", "csv_main", "branch.h5", ("--output", "new.csv")),
    "razy-merge": ("tools.cli", "merge_main", "sweep.h5", ("--output", "new.h5")),
    "razy-check": ("check.cli", "main", "branch.h5", ("--output", "new.h5")),
    "razy-plot": ("plot.cli", "main", "sweep.h5", ("--save", "new.pdf")),
    "razy-import-ross": ("tools.ross", "main", SOURCE / "tests/drivers/ross/cone.toml", ("--output", "new.nml")),
}


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    succeed("razy-sweep", GEAR_PAIR, *SHORT, "--output", folder / "sweep.h5")
    few = sets(follow__max_points=12)
    succeed("razy-follow", SOURCE / "inputs" / "hysteresis.nml", *few, "--output", folder / "branch.h5")
    return folder


@pytest.mark.parametrize("name", TOOLS)
def test_a_limit_of_file_size_is_one_line_of_a_tool(name, results):
    room, main, file, words = TOOLS[name]
    code = f"import sys; from razy.{room} import {main} as main; sys.exit(main())"
    done = subprocess.run(
        [sys.executable, "-c", code, str(results / file), *words],
        stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=PATIENCE,
        env=os.environ | {"PYTHONPATH": str(SOURCE / "post" / "src")},
        preexec_fn=lambda: setrlimit(RLIMIT_FSIZE, (700, 700)),
    )  # fmt: skip
    refused(done, f"{name}: error: ", f"{words[1]}: File too large", exit_code=1)
    assert left() == []


def test_tools_keep_what_they_read():
    succeed("razy-sweep", GEAR_PAIR, *SHORT, "--output", "sweep.h5")
    before = Path("sweep.h5").read_bytes()
    Path("hard.h5").hardlink_to("sweep.h5")
    Path("link.csv").symlink_to("sweep.h5")
    Path("dangling.csv").symlink_to("nothing")
    for output in ("sweep.h5", "./sweep.h5", "hard.h5", "link.csv", "dangling.csv", "/dev/null"):
        for main in ("csv_main", "merge_main"):
            done = call("razy.tools.cli", "sweep.h5", "--output", output, "--force", main=main)
            refused(done, output.split("/")[-1])
    assert Path("sweep.h5").read_bytes() == before
    assert call("razy.tools.cli", "sweep.h5", main="csv_main").returncode == 0
