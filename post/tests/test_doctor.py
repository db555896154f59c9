"""What razy-doctor says."""

import re

from razy.tools.doctor import findings, main


def test_ten_lines_and_the_exit_code_says_whether_there_is_a_program(capsys, monkeypatch, tmp_path):
    monkeypatch.delenv("RAZY_BIN", raising=False)
    program = tmp_path / "razy-run"
    program.write_text("#!/bin/sh\necho razy-run 9.8.7\n")
    program.chmod(0o755)
    assert main(["--programs", str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 10 and "razy-run 9.8.7" in lines[0] and str(program) in lines[0]
    assert main(["--programs", str(tmp_path / "none")]) == 1
    assert "no program razy-run" in capsys.readouterr().out


def test_versions_of_packages_are_said():
    said = dict(findings(None))
    assert re.search(r"numpy \d+\.\d+", said["Python"]) and "GB free" in said["disk"]
