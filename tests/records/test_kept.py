"""What people add to the files of a data set outlasts every export."""

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.records.bids import export_study
from autd_trials.records.merging import NotATableError, merge_lines, merge_objects, merge_table
from autd_trials.testing.script import SessionScript
from tests.records.test_bids import problems, table

words = st.text(st.characters(categories=["L", "N"]), min_size=1, max_size=6)
lines = st.lists(words, max_size=8)


def add_people(study: Path) -> None:
    """Enter what people enter: columns, their descriptions, lines of text, an acknowledgement."""
    path = study / "participants.tsv"
    header, *rows = path.read_text(encoding="utf-8").splitlines()
    grown = [f"{header}\tage\tsex", *(f"{row}\t{30 + number}\tF" for number, row in enumerate(rows))]
    path.write_text("\n".join(grown) + "\n", encoding="utf-8")
    sidecar = study / "participants.json"
    about = json.loads(sidecar.read_text(encoding="utf-8"))
    about["age"] = {"Description": "Age.", "Units": "year"}
    about["sex"] = {"Description": "Sex.", "Levels": {"F": "female", "M": "male"}}
    sidecar.write_text(json.dumps(about), encoding="utf-8")
    readme = study / "README.md"
    text = readme.read_text(encoding="utf-8")
    text = text.replace("## Array\n", "The room was cold.\n\n## Array\n") + "\nAsk Ann.\n"
    readme.write_text(text, encoding="utf-8")
    with (study / "CHANGES").open("a", encoding="utf-8") as changes:
        changes.write("  - Consent forms were scanned.\n")
    description = study / "dataset_description.json"
    about = json.loads(description.read_text(encoding="utf-8"))
    description.write_text(
        json.dumps({**about, "Funding": ["A grant"], "Name": "Our study"}), encoding="utf-8"
    )
    (study / ".bidsignore").write_text("notes.txt\n", encoding="utf-8")
    (study / "notes.txt").write_text("mine", encoding="utf-8")


def test_what_people_add_is_kept_by_every_session_after(study: Path) -> None:
    SessionScript("01").all_trials().save(study)
    export_study(study)
    add_people(study)
    for place, participant in ((2, "02"), (3, "03")):
        SessionScript(participant, place=place).all_trials().note("later").save(study)
        assert export_study(study).told == []
        first, *others = table(study / "participants.tsv")
        assert (first["participant_id"], first["age"], first["sex"]) == ("sub-01", "30", "F")
        assert [(row["participant_id"], row["age"]) for row in others][-1] == (f"sub-{participant}", "n/a")
        assert json.loads((study / "participants.json").read_text())["age"]["Units"] == "year"
        readme = (study / "README.md").read_text(encoding="utf-8")
        assert readme.count("The room was cold.") == readme.count("Ask Ann.") == 1
        assert readme.startswith("**Simulated data")
        assert readme.index("The room was cold.") < readme.index("## Array")
        assert (study / "CHANGES").read_text().count("Consent forms were scanned.") == 1
        about = json.loads((study / "dataset_description.json").read_text())
        assert (about["Funding"], about["Name"]) == (["A grant"], "Our study (simulated)")
        assert (study / ".bidsignore").read_text() == "notes.txt\n"
    assert problems(study) == []


def test_what_cannot_be_kept_in_place_is_laid_aside_and_told(study: Path) -> None:
    SessionScript("01").all_trials().save(study)
    export_study(study)
    people = study / "participants.tsv"
    people.write_bytes(b"\xff\xfep\x00a\x00")  # saved as UTF-16
    (study / "participants.json").write_text("{", encoding="utf-8")
    (events,) = study.glob("sub-01/ses-01/beh/*_events.tsv")
    edited = events.read_text(encoding="utf-8").replace("felt", "FELT")
    events.write_text(edited, encoding="utf-8")
    done = export_study(study)
    assert len(done.told) == 3
    assert all("is kept as sourcedata/edited/" in told for told in done.told)
    assert (study / "sourcedata/edited/participants.tsv").read_bytes() == b"\xff\xfep\x00a\x00"
    assert (study / "sourcedata/edited" / events.name).read_text(encoding="utf-8") == edited
    assert "FELT" not in events.read_text(encoding="utf-8")
    assert table(people)[0]["participant_id"] == "sub-01"
    assert export_study(study).told == []


def test_a_data_set_of_which_nothing_is_remembered_is_laid_aside_too(study: Path) -> None:
    SessionScript("01").all_trials().save(study)
    study.joinpath("README.md").write_text("Ours, from before.\n", encoding="utf-8")
    (told,) = export_study(study).told
    assert "README.md was edited" in told
    assert (study / "sourcedata/edited/README.md").read_text(encoding="utf-8") == "Ours, from before.\n"


@given(made=lines, new=lines, added=st.lists(st.tuples(st.integers(0, 8), words), max_size=5))
def test_lines_that_were_added_are_there_once_and_nothing_made_is_lost(
    made: list[str], new: list[str], added: list[tuple[int, str]]
) -> None:
    theirs = list(made)
    for place, word in added:
        theirs.insert(min(place, len(theirs)), f"+{word}")
    base, there, ours = ("".join(f"{line}\n" for line in text) for text in (made, theirs, new))
    merged = merge_lines(base, there, ours).splitlines()
    assert [line for line in merged if not line.startswith("+")] == new
    assert sorted(line for line in merged if line.startswith("+")) == sorted(f"+{word}" for _, word in added)
    assert merge_lines(ours, merge_lines(base, there, ours), ours).splitlines() == merged


values = st.recursive(st.integers(), lambda below: st.dictionaries(words, below, max_size=3), max_leaves=6)
objects = st.dictionaries(words, values, max_size=4)


@given(base=objects, ours=objects, added=objects)
def test_keys_that_were_added_are_kept_and_those_made_are_there(
    base: dict[str, Any], ours: dict[str, Any], added: dict[str, Any]
) -> None:
    theirs = {**base, **{f"+{key}": value for key, value in added.items()}}
    merged = merge_objects(base, theirs, ours)
    assert {key: value for key, value in merged.items() if not key.startswith("+")} == ours
    assert {key[1:]: value for key, value in merged.items() if key.startswith("+")} == added


people = st.dictionaries(words, words, min_size=1, max_size=5)


@given(before=people, after=people, ages=people)
def test_columns_are_merged_by_their_key(
    before: dict[str, str], after: dict[str, str], ages: dict[str, str]
) -> None:
    def text(header: str, rows: dict[str, str]) -> str:
        return header + "".join(f"\n{key}\t{value}" for key, value in rows.items()) + "\n"

    base, ours = text("id\tplace", before), text("id\tplace", after)
    theirs = "id\tplace\tage\r\n" + "".join(
        f"{key}\t{before.get(key, '')}\t{ages.get(key, '')}\r\n" for key in {**before, **ages}
    )
    merged = [line.split("\t") for line in merge_table(base, theirs, ours).splitlines()]
    assert merged[0] == ["id", "place", "age"]
    kept = {row[0]: row[1:] for row in merged[1:]}
    assert {key: row[0] for key, row in kept.items() if key in after} == after
    assert {key: row[1] for key, row in kept.items() if row[1] != "n/a"} == {
        key: age for key, age in ages.items() if age != "n/a"
    }
    assert set(kept) == {*after, *ages}


@pytest.mark.parametrize("theirs", ["", "name\tage\n", "id\tid\n", "id;place\n1;2\n", "id\tplace\n1\t2\t3\n"])
def test_what_is_no_table_any_more_is_said(theirs: str) -> None:
    with pytest.raises(NotATableError):
        merge_table("id\tplace\n1\t1\n", theirs, "id\tplace\n1\t1\n")
