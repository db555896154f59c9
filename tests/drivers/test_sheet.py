"""The sheet after API 617: what it asks of a compressor, and at which speeds."""

import pytest
from programs import SOURCE
from test_report import report


def test_sheet_after_api_617(folder):
    """As it stands it is kept; with half the clearance and little damping it is missed, and says where."""
    for name in ("report.toml", "compressor.nml"):
        (folder / name).write_text((SOURCE / "inputs/api617" / name).read_text())
    assert report(folder).returncode == 0
    text = (folder / "compressor.nml").read_text()
    (folder / "compressor.nml").write_text(
        text.replace("clearance=2.5e-4", "clearance=4e-5").replace("=1.0e5,", "=1.0e3,")
    )
    done = report(folder)
    assert done.returncode == 1
    page = (folder / "report" / "report.html").read_text()
    assert "largest orbit in a seal over its gap" in page
    assert "missed" in done.stdout


@pytest.mark.parametrize(
    ("changes", "kept"),
    [
        # Unstable from 11576 rpm on, which is above the maximum continuous speed, or below it.
        ({"operating=10500.0,12500.0": "operating=1000.0,6000.0"}, True),
        ({}, False),
        # Neither a ring nor a peak of order 1.
        ({"operating=10500.0,12500.0": "operating=1000.0,6000.0", "last=14000.0": "last=3000.0", "&ring ": "!"}, True),
        ({"operating=10500.0,12500.0": "operating=16000.0,17000.0"}, False),
    ],
)
def test_decrements_of_the_sheet_are_those_in_operation(folder, changes, kept):
    (folder / "report.toml").write_text((SOURCE / "inputs/api617/report.toml").read_text())
    text = (SOURCE / "inputs/api617/compressor.nml").read_text()
    changes = changes | {
        "density=7850.0": "density=7850.0, damping_ratio=0.01, damping='nodal'",
        "&rotation ": "&rotation circulatory=.true., ",
    }
    for old, new in changes.items():
        assert text.count(old) == 1
        text = text.replace(old, new)
    (folder / "compressor.nml").write_text(text)
    assert (report(folder).returncode == 0) == kept
