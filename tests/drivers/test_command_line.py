"""Options, exit codes, and what becomes of the output file."""

import os
import time
from pathlib import Path

import pytest
from programs import GEAR_PAIR, attribute, datasets, left, sets, start, succeed

PROGRAMS = ["razy-run", "razy-sweep"]
SHORT = sets(motion__t_end=0.02, record__from=0.01, sweep__step=400)
ENDLESS = sets(motion__t_end=1e9)


@pytest.fixture(params=PROGRAMS)
def program(request):
    return request.param


def test_help(program):
    for option in ("--help", "-h"):
        done = succeed(program, option)
        assert done.stderr == ""
        for word in ("usage", "--output", "--force", "--set", "--check", "--help", "--version", "exit code"):
            assert word in done.stdout, word


def test_version(program):
    assert succeed(program, "--version").stdout.startswith(f"{program} {os.environ['RAZY_VERSION']} (")


@pytest.mark.parametrize("case", ["snap_through.nml", "vibropress.nml"])
def test_check_prints_the_input_and_nothing_of_the_arithmetic(case):
    assert succeed("razy-run", GEAR_PAIR.parent / case, "--check").stderr == ""


def test_default_output_is_the_name_of_the_case_in_the_current_folder(program):
    done = succeed(program, GEAR_PAIR, *SHORT)
    assert left() == ["torsional_gear_pair.h5"]
    assert done.stdout.endswith("events\n") == (program == "razy-run")
    assert "wrote torsional_gear_pair.h5" in done.stderr
    assert attribute("torsional_gear_pair.h5", "program") == program
    assert attribute("torsional_gear_pair.h5", "title") == "Torsional gear pair"
    assert attribute("torsional_gear_pair.h5", "razy_version") == os.environ["RAZY_VERSION"]


def test_output_in_two_spellings(program):
    Path("new").mkdir()
    succeed(program, GEAR_PAIR, *SHORT, "--output", "new/a file.h5")
    succeed(program, GEAR_PAIR, *SHORT, "--output=other.h5")
    assert sorted(map(str, Path().rglob("*.h5"))) == ["new/a file.h5", "other.h5"]


def test_set_in_two_spellings_the_last_one_counts(program):
    options = ["--set=rotation%speed_rpm=1700", "--set", "load(1)%value=90", "--set", "load(1)%value=100"]
    text = succeed(program, GEAR_PAIR, *options, "--check").stdout
    assert "speed_rpm = 1700.0\n" in text
    assert "value = 100.0\n" in text
    assert "value = 90.0\n" not in text


def test_check_prints_the_effective_input_and_computes_nothing(program):
    done = succeed(program, GEAR_PAIR, "--check", *ENDLESS, timeout=20)
    assert done.stderr == ""
    assert "damping = 0.0\n" in done.stdout
    assert left() == []


def test_check_needs_no_free_output(program):
    Path("torsional_gear_pair.h5").write_text("precious")
    succeed(program, GEAR_PAIR, "--check")
    assert Path("torsional_gear_pair.h5").read_text() == "precious"


def test_existing_file_is_refused_before_anything_is_computed(program):
    succeed(program, GEAR_PAIR, *SHORT)
    before = Path("torsional_gear_pair.h5").read_bytes()
    done = start(program, GEAR_PAIR, *ENDLESS, timeout=20)
    assert done.returncode == 2
    assert done.stderr == "torsional_gear_pair.h5: exists already; --force overwrites it\n"
    assert Path("torsional_gear_pair.h5").read_bytes() == before


def test_force_overwrites(program):
    succeed(program, GEAR_PAIR, *SHORT)
    before = datasets("torsional_gear_pair.h5")
    succeed(program, GEAR_PAIR, *SHORT, *sets(gear_mesh__backlash=0), "--force")
    assert datasets("torsional_gear_pair.h5") != before
    assert attribute("torsional_gear_pair.h5", "program") == program
    assert left() == ["torsional_gear_pair.h5"]


def one_line(done):
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.endswith("\n") and done.stderr.count("\n") == 1, done.stderr
    return done.stderr


@pytest.mark.parametrize(
    ("output", "says"),
    [("missing/x.h5", "does not exist"), ("folder", "is a directory"), ("", "empty"), ("file/x.h5", "file")],
)
def test_output_that_cannot_be_written_is_refused_at_once(program, output, says):
    Path("folder").mkdir()
    Path("file").touch()
    for more in ([], ["--force"]):
        done = start(program, GEAR_PAIR, *ENDLESS, "--output", output, *more, timeout=20)
        assert says in one_line(done)
    assert left() == ["file", "folder"]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_folder_without_permission(program):
    Path("locked").mkdir(mode=0o555)
    assert "locked" in one_line(start(program, GEAR_PAIR, *ENDLESS, "--output", "locked/x.h5", timeout=20))


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ([], "no input file"),
        ([GEAR_PAIR, "--frce"], "did you mean '--force'?"),
        ([GEAR_PAIR, "other.nml"], "one input file only"),
        ([GEAR_PAIR, "--output"], "--output needs a value"),
        ([GEAR_PAIR, "--set"], "--set needs a value"),
        (["missing.nml"], "missing.nml: there is no such file"),
        (["."], "directory"),
        ([GEAR_PAIR, "--set", "stiffness=1"], "GROUP%KEY=VALUE"),
        ([GEAR_PAIR, "--set", "spring%stiffness=1"], "spring(1)%stiffness to spring(2)%stiffness"),
        ([GEAR_PAIR, "--set", "spring(3)%stiffness=1"], "must be 1 to 2"),
        ([GEAR_PAIR, "--set", "spring(1)%stiffnes=1"], "did you mean 'stiffness'?"),
        ([GEAR_PAIR, "--set", "motion%t_end=-1"], "positive real number in s"),
        ([GEAR_PAIR, "--set", "motion%t_end=1e400"], "finite"),
        ([GEAR_PAIR, "--set", "motion%t_end="], "missing"),
    ],
)
def test_wrong_usage_is_one_line_and_exit_code_2(program, arguments, says):
    assert says in one_line(start(program, *arguments, timeout=20))
    assert left() == []


def test_progress_of_a_sweep_without_a_terminal_is_a_line_now_and_then():
    began = time.monotonic()
    lines = succeed("razy-sweep", GEAR_PAIR).stderr.splitlines()
    assert lines[-1].startswith("wrote torsional_gear_pair.h5: 401 points, 0 failed, ")
    assert 1 <= len(lines) - 1 <= 10
    assert all(" of 401 points, " in line and " s left" in line for line in lines[:-1])
    assert float(lines[-2].split(", ")[1].split()[0]) <= time.monotonic() - began
