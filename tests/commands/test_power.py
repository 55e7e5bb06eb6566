"""`autd-trials power`, as a person types it."""

from pathlib import Path

import pytest

from tests.commands.conftest import Run


def test_a_table_and_a_curve(run: Run, tmp_path: Path) -> None:
    result = run(
        "power", "chest", "--participants", "6-8", "--studies", 200, "--jobs", 1, "--out", tmp_path, "--json"
    )
    assert result.code == 0
    assert {row["participants"] for row in result.json["rows"]} == {6, 7, 8}
    assert "assumed model" in result.json["population"]
    lines = (tmp_path / "power.tsv").read_text().splitlines()
    assert len(lines) == 1 + 3 * 3 * 2
    assert (tmp_path / "power.png").stat().st_size > 10_000
    assert (tmp_path / "power.pdf").read_bytes().startswith(b"%PDF")
    svg = (tmp_path / "power.svg").read_bytes()
    run("power", "chest", "--participants", "6-8", "--studies", 200, "--jobs", 1, "--out", tmp_path)
    assert (tmp_path / "power.svg").read_bytes() == svg


def test_a_folder_that_cannot_be_written_is_said(run: Run, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    out = tmp_path / "file" / "power"
    result = run("power", "chest", "--participants", "6", "--studies", 10, "--jobs", 1, "--out", out)
    assert result.code == 4
    assert "cannot write the results" in result.err


def test_plain_words(run: Run) -> None:
    result = run("power", "chest", "--participants", "8", "--studies", 100, "--jobs", 1)
    assert "n = 8" in result.out
    assert "without a difference" in result.out
    assert "100 studies of each size, seed 1" in result.out
    assert "p <= 0.05" in result.out
    for test in ("sign_flip", "paired_t"):
        assert f"inner - inner_outer, modulation_hz 50, {test}: 8" in result.out, "the smallest size with .8"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--studies", "0"], "--studies is 0"),
        (["--alpha", "2"], "--alpha is 2"),
        (["--jobs", "0"], "--jobs is 0"),
        (["--rates", "none.csv", "--cell-sd", "-1"], "give 0 to 20"),
        (["--rates", "none.csv", "--common-sd", "nan"], "give 0 to 20"),
        (["--seed", "-1"], "--seed is -1"),
        (["--common-sd", "2"], "go with --rates"),
        (["--rates", "none.csv"], "cannot be read"),
    ],
)
def test_nonsense_is_refused(run: Run, arguments: list[str], message: str) -> None:
    result = run("power", "chest", *arguments)
    assert result.code == 2
    assert message in result.err


@pytest.mark.parametrize("sizes", ["2", "24-4", "a", "8,8", "4-2000"])
def test_wrong_sizes_are_refused(run: Run, sizes: str) -> None:
    with pytest.raises(SystemExit) as stopped:
        run("power", "chest", "--participants", sizes)
    assert stopped.value.code == 2


def test_a_cluster_that_does_not_answer_is_told(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    import distributed

    def refuse(*_arguments: object, **_options: object) -> None:
        raise OSError("connection refused")

    monkeypatch.setattr(distributed, "Client", refuse)
    result = run("power", "chest", "--dask", "tcp://127.0.0.1:1")
    assert result.code == 4
    assert "no Dask scheduler answers" in result.err
