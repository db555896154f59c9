"""Variants of the library for bench/ablation.py: the sources with small patches, built in folders of their own."""

import hashlib
import shutil
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

PROJECT = """\
cmake_minimum_required(VERSION 3.25)
project(razy LANGUAGES C Fortran)
set(CMAKE_BUILD_TYPE Release)
find_package(LAPACK REQUIRED)
find_library(RAZY_ARPACK_LIBRARY arpack REQUIRED)
find_package(MPI REQUIRED COMPONENTS Fortran)
find_package(HDF5 REQUIRED COMPONENTS Fortran HL)
include(GNUInstallDirs)
include(cmake/RazyCompiler.cmake)
include(cmake/RazyVersion.cmake)
set(CMAKE_Fortran_MODULE_DIRECTORY ${PROJECT_BINARY_DIR}/modules)
add_subdirectory(src)
add_executable(p3 drivers/sweep_axes.f90 drivers/sweep_starts.f90 drivers/sweep_case.f90 bench/p3.f90)
target_link_libraries(p3 PRIVATE razy razy_flags)
"""


class PatchError(Exception):
    """The text of a patch is not in the sources as often as it should be: the sources have changed."""


@dataclass
class Patch:
    """Replace `old` by `new` in a file where `old` stands exactly `times` times."""

    path: str
    old: str
    new: str
    times: int = 1

    def apply(self, folder):
        path = Path(folder) / self.path
        path.write_text(self.applied(path.read_text(encoding="utf-8")), encoding="utf-8")

    def applied(self, text):
        found = text.count(self.old)
        if found != self.times:
            raise PatchError(f"{self.path}: {self.old!r} found {found} times instead of {self.times}")
        return text.replace(self.old, self.new)


@dataclass
class Variant:
    """A name, one sentence that says what is different, patches, and options for CMake."""

    name: str
    meaning: str
    patches: list[Patch] = field(default_factory=list)
    options: list[str] = field(default_factory=list)


SEARCH, JUDGE, REFINE, FORMS, CURSOR, MOVES, RESPONSE, PROPAGATION, SMOOTH, STATES = (
    f"src/integrate/{name}.f90"
    for name in (
        "search",
        "step_verdict",
        "refine",
        "forms",
        "cursor",
        "cursor_moves",
        "response",
        "propagation",
        "exact_smooth",
        "contact_states",
    )
)
TONE, TASK, COMPILER = "src/core/tone.f90", "src/sweep/motion_task.f90", "cmake/RazyCompiler.cmake"

PREPARE = "      call prepare(self, response, rows, start, tau_from, tau_end, watched, leaves)\n"
MARGIN = "      margin = proved_margin(w%f0, w%g0, w%f1, w%g1, h, m4)\n"
BOUND = """\
               do j = 1, merge(response%amplitudes, 0, response%simple)
                  m4 = m4 + rows%size4(j, w%form)*self%modulus(j)*merge(response%modulus(j), 1.0_wp, w%order == 1)
               end do
"""


def signs_only(steps):
    """Decide by the signs of f at the ends of a step, the longest power of two in so many parts of the fastest period.

    Only a step that starts on the bound is halved. `response%m >= 0` always holds; it keeps the compiler from warning
    of what is not reached.
    """
    level = f"exponent(response%fastest*({steps}/(2*acos(-1.0_wp))))"
    judge = f"""\
      verdict = stays
      if (w%f1 < 0.0_wp) verdict = leaves
      room = level > {level}
      if (level >= finest_level .or. h*response%fastest <= shortest) return
      if (verdict == leaves .and. w%g0 > 0.0_wp .and. .not. w%f0 > 0.0_wp) verdict = undecided
      if (response%m >= 0) return
"""
    return [
        Patch(SEARCH, PREPARE, f"      self%level = {level}\n{PREPARE}"),
        Patch(JUDGE, f"      m4 = w%m4\n{GENERAL}", f"{judge}      m4 = w%m4\n{GENERAL}"),
        Patch(SEARCH, BOUND, ""),
        Patch(SEARCH, "            if (stay_forever(self, response, rows, watched)) exit\n", ""),
    ]


GENERAL = "      if (.not. response%bounded) m4 ="
LONGER = ("h, m4", "longer, m4")
MONOTONE = "      if (proved_monotone(w%f0, w%g0, w%f1, w%g1, h, m4, w%noise)) return\n"
CURVATURE = "      call proved_curvature(w%f0, w%g0, w%f1, w%g1, h, m4, w%noise, d0, d1, curvature)\n"
PROOF_TWICE = [
    Patch(
        REFINE,
        "      logical :: stale = .false.\n",
        "      logical :: stale = .false.\n      real(wp) :: spent = 0.0_wp\n",
    ),
    Patch(JUDGE, "real(wp) :: change, margin, m4, d0, d1\n", "real(wp) :: change, margin, m4, d0, d1, longer\n"),
    Patch(
        JUDGE,
        MARGIN,
        "      longer = h*(1.0_wp + 1.0e-9_wp)\n"
        f"      w%spent = w%spent + {MARGIN.split('= ')[1].strip().replace(*LONGER)}\n{MARGIN}",
    ),
    Patch(JUDGE, MONOTONE, f"{MONOTONE.replace(*LONGER).replace(' return', ' w%spent = w%spent + 1')}{MONOTONE}"),
    Patch(JUDGE, CURVATURE, f"{CURVATURE.replace(*LONGER)}      w%spent = w%spent + d0 + d1 + curvature\n{CURVATURE}"),
    Patch(
        SEARCH,
        BOUND,
        f"{BOUND.replace('%modulus(j)*', '%modulus(j)*1.000000001_wp*')}"
        f"               w%spent = w%spent + m4\n               m4 = 0.0_wp\n{BOUND}",
    ),
]
"""What is computed in addition differs in the tenth digit and is added up, so that no compiler can leave it out."""

NOTHING_RARE = [
    Patch(RESPONSE, "call find_driven(basis, load, harmonic, omega, driven)", "driven = .false."),
    Patch(CURSOR, "response%nx", "0", 3),
    Patch(CURSOR, "size(response%dense)", "0", 2),
    Patch(CURSOR, "response%tones", "1"),
    Patch(CURSOR, "response%driven%loaded", ".false."),
    Patch(MOVES, "response%nx", "0", 5),
    Patch(MOVES, "size(response%dense)", "0", 3),
    Patch(MOVES, "response%driven%count", "0", 5),
    Patch(FORMS, "response%nx", "0", 4),
    Patch(FORMS, "response%driven%count", "0"),
    Patch(JUDGE, "response%bounded", ".true."),
    Patch(SEARCH, "response%nx", "0"),
    Patch(SEARCH, "response%bounded", ".true."),
    Patch(SEARCH, "      if (response%simple) return\n", "      if (.true.) return\n"),
    Patch(SEARCH, "response%growing", ".false.", 2),
    Patch(PROPAGATION, "state%response%growing", ".false."),
]

PRESENT = Variant("as it is", "The library as the release preset builds it.")

VARIANTS = [
    PRESENT,
    Variant(
        "proof twice",
        "All bounds and proofs are computed a second time: what is added is what their arithmetic costs.",
        PROOF_TWICE,
    ),
    Variant(
        "signs in quarter steps",
        "In place of the proof the signs at the ends of fixed steps, the longest power of two below a quarter of the "
        "fastest period, as prototypes do.",
        signs_only(4),
    ),
    Variant("signs in half steps", "The same with steps below half of the fastest period.", signs_only(2)),
    Variant("signs in whole steps", "The same with steps below the fastest period.", signs_only(1)),
    Variant(
        "nothing rare",
        "One tone, no mode that needs the matrix exponential and none that grows are constants of the program: what it "
        "costs that the same code takes any machine.",
        NOTHING_RARE,
    ),
    Variant(
        "neither",
        "Signs in half steps and nothing rare, compiled for this processor: near to a program for this machine alone.",
        signs_only(2) + NOTHING_RARE,
        ["-DRAZY_NATIVE=ON"],
    ),
    Variant(
        "all coordinates",
        "All four coordinates are followed, also what neither a contact nor an observable feels.",
        [
            Patch(
                TASK,
                "chains .or. self%watch%strobe_periods > 0, error)",
                ".true., error)",
            )
        ],
    ),
    Variant(
        "modes not kept",
        "Coupled coordinates and modes are computed anew at each speed.",
        [
            Patch(
                STATES,
                "known = same_structure(self%machine, machine) .and. (self%keep_all .eqv. keep_all)",
                "known = .false.",
            )
        ],
    ),
    Variant(
        "time in one double",
        "Time is one double and the phase of a tone is omega times it.",
        [
            Patch(
                SMOOTH,
                "call add_time(piece%time, piece%time_low, piece%duration)",
                "piece%time = piece%time + piece%duration",
            ),
            Patch(TONE, "angle = two_pi*((turns - anint(turns)) + rest)", "angle = self%omega*time"),
        ],
    ),
    Variant(
        "no link-time optimisation",
        "Each file is compiled on its own.",
        [Patch(COMPILER, "set(CMAKE_INTERPROCEDURAL_OPTIMIZATION_RELEASE ON)", "")],
    ),
    Variant(
        "vectorisation",
        "Without `-fno-tree-vectorize`.",
        [Patch(COMPILER, "-O3 -fstack-arrays -fno-tree-vectorize", "-O3 -fstack-arrays")],
    ),
    Variant("native", "With `-DRAZY_NATIVE=ON`, instructions of this processor.", [], ["-DRAZY_NATIVE=ON"]),
]


def misfits(chosen=None, root=ROOT):
    """Return what does not fit the sources below `root` any more, a line for each variant; nothing is built."""
    lines = []
    for variant in VARIANTS if chosen is None else chosen:
        texts = {}
        try:
            for patch in variant.patches:
                if patch.path not in texts:
                    texts[patch.path] = (root / patch.path).read_text(encoding="utf-8")
                texts[patch.path] = patch.applied(texts[patch.path])
        except (OSError, PatchError) as exc:
            lines.append(f"{variant.name}: {exc}")
    return lines


def prepare(folder):
    """Copy the sources that a variant is made of."""
    for part in ("src", "cmake", "drivers"):
        shutil.copytree(ROOT / part, folder / part)
    (folder / "bench").mkdir()
    shutil.copy(ROOT / "bench" / "p3.f90", folder / "bench")
    (folder / "CMakeLists.txt").write_text(PROJECT, encoding="utf-8")


def restore(patch, folder):
    (folder / patch.path).write_text((ROOT / patch.path).read_text(encoding="utf-8"), encoding="utf-8")


def build(variant, folder):
    """Build a variant in a folder below `folder`; return the path of its program.

    Variants compiled alike share a folder, in which only the patched files are compiled again.
    """
    compiled_alike = repr((variant.options, [patch.new for patch in variant.patches if patch.path == COMPILER]))
    place = Path(folder) / hashlib.sha256(compiled_alike.encode()).hexdigest()[:8]
    if not place.exists():
        prepare(place)
    for patch in variant.patches:
        patch.apply(place)
    generator = ["-G", "Ninja"] if shutil.which("ninja") else []
    for command in (
        ["cmake", *generator, "-S", str(place), "-B", str(place / "build"), *variant.options],
        ["cmake", "--build", str(place / "build"), "--target", "p3", "--parallel", "2"],
    ):
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise PatchError(f"{variant.name}: {' '.join(command)}:\n{done.stdout[-3000:]}{done.stderr[-3000:]}")
    for patch in variant.patches:
        if patch.path != COMPILER:
            restore(patch, place)
    program = Path(folder) / f"p3 {variant.name}"
    shutil.copy(place / "build" / "p3", program)
    return program
