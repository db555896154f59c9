"""A program whose memory is taken away ends with a line. When it asks for more varies: a slow check."""

import resource
import shlex
import subprocess
from pathlib import Path

import pytest
from faults import kill_all, processes_of, rank_of, wait_for
from programs import GEAR_PAIR, PATIENCE, SOURCE, command, sets


def said_without_memory():
    """Take the memory of one of two ranks away; return what was said then."""
    words = command(
        "razy-sweep", GEAR_PAIR, *sets(motion__t_end=100, record__from=0, sweep__step=20), "--force", ranks=2
    )
    Path("torsional_gear_pair.h5.checkpoint").unlink(missing_ok=True)
    with Path("log").open("w") as log:
        process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True)
    try:
        wait_for(lambda: Path("torsional_gear_pair.h5.checkpoint").exists(), "the sweep does not begin")
        last = next(number for number in processes_of(process.pid) if rank_of(number) == 1)
        lines = Path(f"/proc/{last}/status").read_text().splitlines()
        size = 1024 * int(next(line for line in lines if line.startswith("VmSize")).split()[1])
        resource.prlimit(last, resource.RLIMIT_AS, (size + 2**22, size + 2**22))
        assert process.wait(timeout=PATIENCE) != 0
    finally:
        kill_all(process)
    assert Path("torsional_gear_pair.h5.checkpoint").exists()
    return Path("log").read_text()


def test_a_rank_without_memory_says_so():
    """The limit holds for the stack and for other libraries too, which end as they like: one of three is to be ours."""
    for _ in range(3):
        said = said_without_memory()
        if "out of memory" in said:
            break
    assert "out of memory" in said and "SIGSEGV" not in said and "Segmentation" not in said


@pytest.mark.parametrize("program", ["razy-sweep", "razy-follow"])
def test_no_limit_of_memory_crashes_a_program(program):
    """From what MPI cannot begin with to what suffices: the line is said for libraries, and for their threads, too."""
    case = SOURCE / "inputs" / "impact_oscillator.nml"
    words = shlex.join(command(program, case, "--force", "--output", "case.h5"))
    said = ""
    for limit in range(104, 130):
        script = f"ulimit -v {1000 * limit}; exec {words}"
        done = subprocess.run(["bash", "-c", script], stdin=subprocess.DEVNULL, capture_output=True, timeout=PATIENCE)
        end = done.stderr.decode(errors="replace")
        assert done.returncode in (0, 1, 2), (limit, done.returncode, end[-2000:])
        said += end
    assert "out of memory" in said and "SIGSEGV" not in said
