"""The codes that are compared, their settings, and how each is started."""

import importlib.util
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

BENCH = Path(__file__).resolve().parents[1]


@dataclass
class Code:
    """One code: settings for P2, for all speeds of P3, and for a sample of them (with the time of all estimated)."""

    name: str
    command: list[str]
    p2: list[str] = field(default_factory=list)
    p3: list[str] = field(default_factory=list)
    p3_sample: list[str] = field(default_factory=list)
    note: str = ""


def each(pattern, *values):
    return [pattern.format(value) for value in values]


def missing_module(*names):
    absent = [name for name in names if importlib.util.find_spec(name) is None]
    return f"Python packages {', '.join(absent)} (pip install -r bench/requirements.txt)" if absent else ""


def make(target, build):
    """Build a compiled program; return what is missing when that fails."""
    done = subprocess.run(
        ["make", "-C", str(BENCH), target, f"BUILD={build}"], capture_output=True, text=True, check=False
    )
    return "" if done.returncode == 0 else done.stderr.strip() or f"make {target} failed"


def missing_compiled(target, build, needs):
    """Build a peer; return the packages that it needs, with the first complaint, when that fails."""
    complaint = make(target, build)
    return f"{needs}: {complaint.splitlines()[0]}" if complaint else ""


def razy(razy_bin, build):
    """The exact propagator, and DOP853 with events."""
    if razy_bin:
        os.environ["RAZY_BIN"] = str(razy_bin)
    found = all(shutil.which(name, path=razy_bin) for name in ("razy-run", "razy-sweep"))
    missing = "" if found else "razy-run and razy-sweep (./setup.sh, or --razy-bin)"
    command = [sys.executable, str(BENCH / "peers" / "razy.py")]
    missing = (
        missing or missing_module("h5py") or missing_compiled("motion", build, "the release build of razy's library")
    )
    os.environ["RAZY_MOTION"] = str(Path(build).resolve() / "motion")
    exact = Code("razy", command, p2=["exact"], p3=["exact"])
    dop853 = Code("razy DOP853", command)
    dop853.p2 = each("dop853:{}", "1e-5", "1e-6", "1e-7", "1e-8", "1e-9", "1e-10", "1e-11")
    dop853.p3 = each("dop853:{}", "1e-7", "3e-8", "1e-8", "3e-9", "1e-9", "3e-10", "1e-10")
    return [(exact, missing), (dop853, missing)]


def heyoka(full):
    code = Code("heyoka", [sys.executable, str(BENCH / "peers" / "heyoka_taylor.py")])
    code.p2 = each("full:single:{}", "1e-4", "1e-6", "1e-9", "1e-12", "0") + ["relative:single:1e-9"]
    code.p3 = each("full:8:{}", "1e-6", "1e-9", "0") + ["relative:8:1e-9"]
    if full:
        code.p3 += each("full:8:{}", "1e-4", "1e-12") + each("relative:8:{}", "1e-4", "1e-6", "0")
        code.p3 += each("full:single:{}", "1e-6", "1e-9") + ["full:4:1e-9"]
    return code, missing_module("heyoka")


def hairer(full, build):
    """DOP853 itself, in Fortran."""
    needs = "DOP853 (apt install gcc g++ gfortran make; make -C bench numbalsoda fetches its sources from PyPI)"
    code = Code("DOP853 Fortran", [str(Path(build) / "dop853")])
    code.p2 = each("dop853:relative:{}", "1e-7", "1e-8", "1e-9", "1e-10") + ["dop853:full:1e-8"]
    code.p3 = each("dop853:relative:{}", "1e-8", "2e-9", "1e-9")
    if full:
        code.p3 += each("dop853:relative:{}", "1e-7", "1e-10") + each("dop853:full:{}", "1e-8", "1e-9")
    return code, missing_compiled("dop853", build, needs)


def odeint(full, build):
    code = Code("Boost.odeint", [str(Path(build) / "odeint")])
    code.p2 = each("fehlberg78:relative:{}", "1e-6", "1e-7", "1e-8", "1e-9", "1e-10") + ["fehlberg78:full:1e-8"]
    code.p2 += each("dopri5:relative:{}", "1e-6", "1e-7", "1e-8", "1e-9") + ["dopri5:full:1e-8"]
    code.p3 = each("fehlberg78:relative:{}", "1e-7", "3e-8", "1e-8", "1e-9") + ["dopri5:relative:1e-8"]
    if full:
        code.p3 += ["fehlberg78:relative:1e-10"] + each("fehlberg78:full:{}", "3e-8", "1e-8", "1e-9")
        code.p3 += each("dopri5:relative:{}", "1e-7", "1e-9") + ["dopri5:full:1e-8"]
    return code, missing_compiled("odeint", build, "Boost.odeint (apt install libboost-dev g++ make)")


def gsl(full, build):
    code = Code("GSL", [str(Path(build) / "gsl")])
    code.p2 = each("rk8pd:relative:{}", "1e-6", "1e-7", "1e-8", "1e-9") + ["rk8pd:full:1e-8"]
    code.p2 += each("rkck:relative:{}", "1e-7", "1e-8")
    code.p3 = each("rk8pd:relative:{}", "1e-7", "3e-8", "1e-8")
    if full:
        code.p3 += ["rk8pd:relative:1e-9"] + each("rk8pd:full:{}", "3e-8", "1e-8") + ["rkck:relative:1e-9"]
    return code, missing_compiled("gsl", build, "GSL (apt install libgsl-dev g++ make)")


def sundials(full, build):
    missing = missing_compiled("sundials", build, "SUNDIALS (apt install libsundials-dev gcc make)")
    command = [str(Path(build) / "sundials")]
    arkode, cvode = Code("ARKODE", command), Code("CVODE", command)
    arkode.p2 = each("dopri5:full:events:{}", "1e-6", "1e-7", "1e-8", "1e-9", "1e-10")
    arkode.p2 += each("dopri5:relative:events:{}", "1e-7", "1e-8") + ["dopri5:full:through:1e-10"]
    arkode.p2 += each("verner8:full:events:{}", "1e-9", "1e-11") + each("fehlberg13:full:events:{}", "1e-8", "1e-10")
    cvode.p2 = each("adams:full:events:{}", "1e-6", "1e-7", "1e-8", "1e-9", "1e-10")
    cvode.p2 += each("adams:relative:events:{}", "1e-8", "1e-9") + each("bdf:full:events:{}", "1e-8", "1e-10")
    cvode.p2 += each("adams:full:through:{}", "1e-8", "1e-10", "1e-12")
    if full:
        arkode.p3 = each("dopri5:relative:events:{}", "1e-8", "1e-9") + ["cashkarp:relative:events:1e-9"]
        arkode.p3 += ["dopri5:full:events:1e-9"]
        cvode.p3 = each("adams:relative:events:{}", "1e-9", "1e-10") + each("adams:full:events:{}", "1e-9", "1e-10")
        arkode.p3_sample = ["verner8:relative:events:1e-9"] + each("fehlberg13:relative:events:{}", "1e-9", "1e-10")
        cvode.p3_sample = ["bdf:relative:events:1e-9", "adams:relative:through:1e-10"]
    else:
        arkode.p3_sample = each("dopri5:relative:events:{}", "1e-8", "1e-9")
        cvode.p3_sample = each("adams:relative:events:{}", "1e-9", "1e-10")
    return [(arkode, missing), (cvode, missing)]


def scipy(full):
    code = Code("SciPy", [sys.executable, str(BENCH / "peers" / "scipy_ivp.py")])
    code.p2 = each("DOP853:events:{}:inf", "1e-6", "1e-8")
    code.p3_sample = ["DOP853:events:1e-9:inf"]
    if full:
        code.p2 += each("DOP853:events:{}:inf", "1e-5", "1e-7", "1e-10") + each("RK45:events:{}:inf", "1e-6", "1e-7")
        code.p2 += each("LSODA:through:{}:inf", "1e-8", "1e-9", "1e-11") + ["LSODA:events:1e-8:inf"]
        code.p2 += ["DOP853:through:1e-9:inf", "Radau:through:1e-6:inf"]
        code.p3_sample += each("DOP853:events:{}:inf", "1e-7", "1e-8") + ["DOP853:events:1e-9:5e-5"]
        code.p3_sample += each("LSODA:through:{}:inf", "1e-9", "1e-10") + ["RK45:events:1e-8:inf"]
    return code, missing_module("scipy")


def octave(full):
    code = Code("Octave ode45", ["octave-cli", "--norc", "--quiet", str(BENCH / "peers" / "octave_ode45.m")])
    code.p2 = each("through:{}", "default", "1e-6", "1e-8") if full else ["through:default"]
    code.note = "P3 is estimated from P2, by simulated time"
    return code, "" if shutil.which("octave-cli") else "Octave, optional (apt install octave)"


def all_codes(full, build, razy_bin):
    """Pairs of a code and what is missing to run it (empty when nothing is)."""
    compiled = [hairer(full, build), odeint(full, build), gsl(full, build), *sundials(full, build)]
    return [*razy(razy_bin, build), heyoka(full), *compiled, scipy(full), octave(full)]
