"""Obstacles that the first users of the first release met, point by point.

Each of the fifteen is covered by the tests on its line of ``SHOWN_BY``; those without a test in
another module are here. Numbers are the issue's.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path
from typing import Any, Final

import httpx
import pytest

from tests.missions import Document, drawn_targets
from tests.service.conftest import Service, contract
from tests.service.factories import EPOCH, ground_station, post, satellite, send, target, tle
from tests.service.jobs.mission import Mission, running
from tests.service.problems import assert_problem

TESTS: Final = Path(__file__).resolve().parents[1]
HERE: Final = "service/test_first_impressions.py"
BROWSER: Final = "service/dashboard/browser"

SHOWN_BY: Final = {
    "1 names stand beside ids": (
        "service/exports/test_routes.py::test_every_form_names_stations_and_satellites",
        f"{BROWSER}/test_in_the_way.py::test_a_contact_is_told_by_the_name_of_its_station",
    ),
    "2 a plan that breaks limits is not green": (
        "service/jobs/test_api.py::test_a_plan_that_breaks_limits_says_so_on_its_job_and_in_the_list",
        "service/webhooks/test_delivery.py::test_an_end_tells_whether_the_plan_breaks_limits",
        f"{BROWSER}/test_in_the_way.py::test_a_plan_that_breaks_limits_is_not_green_in_the_list",
    ),
    "3 satellites and stations are changed, and never doubled": (
        "service/test_changes_by_patch.py::test_only_the_settings_given_change",
        "service/test_changes_by_patch.py::test_a_station_can_change_in_all_that_it_is_made_of",
        "service/test_changes_by_patch.py::test_a_station_that_is_imported_again_is_updated",
        "service/test_satellites.py::test_a_catalogue_number_is_taken_once",
    ),
    "4 an image that cannot be by itself is named before the search": (
        f"{HERE}::test_a_recorder_in_the_wrong_unit_is_named_before_the_search",
        f"{HERE}::test_an_image_longer_than_its_accesses_is_named_as_the_cause",
        "planner_core/test_mistakes.py::"
        "test_an_image_longer_than_any_access_is_told_before_there_are_any",
        "planner_core/test_mistakes.py::test_an_image_that_no_battery_can_pay_is_named",
    ),
    "5 swapped angles and targets at sea are told": (
        f"{HERE}::test_swapped_latitude_and_longitude_are_told",
        "planner_core/test_mistakes.py::test_targets_at_sea_are_told_and_how_they_would_be_on_land",
    ),
    "6 tables are read as they come, and columns that are not read are told": (
        "service/test_target_catalogs.py::test_files_of_spreadsheets_are_read_as_they_come",
        f"{HERE}::test_decimal_commas_between_commas_are_refused_with_what_to_do",
        f"{HERE}::test_a_priority_column_is_told_to_be_ignored",
        f"{BROWSER}/test_in_the_way.py::test_a_priority_column_is_spoken_of",
    ),
    "7 all old elements are named, and the setting that allows them": (
        f"{HERE}::test_all_old_elements_are_named_with_the_setting_that_allows_them",
    ),
    "8 the page tells what would give an access": (
        f"{BROWSER}/test_what_if.py::test_the_angle_that_would_do_is_said_and_tried",
    ),
    "9 actions are pins, and names are ids": (
        "service/test_pins.py::test_actions_of_a_timeline_are_pins_as_they_are",
        "service/test_pins.py::test_names_stand_for_ids_where_one_has_the_name",
    ),
    "10 what is old is deleted": (
        "service/jobs/test_deletion.py::test_a_finished_job_is_deleted_with_its_answer",
        "service/jobs/test_deletion.py::test_what_is_old_goes_and_what_is_needed_stays",
        "service/jobs/test_deletion.py::test_workers_delete_by_age_and_at_last_the_scenario",
    ),
    "11 lists are narrowed": (
        "service/test_filters.py::test_lists_are_narrowed_by_a_part_of_a_name",
        "service/test_filters.py::test_lists_are_narrowed_by_satellite_and_station",
        "service/jobs/test_deletion.py::test_lists_are_narrowed_by_time",
    ),
    "12 more freedom never looks worse": (
        "service/test_compare_spacing.py::test_no_row_is_worse_than_the_one_above",
    ),
    "13 the pages do not get in the way": (
        f"{BROWSER}/test_crowd.py::test_names_on_the_map_of_a_job_never_overprint",
        f"{BROWSER}/test_crowd.py::"
        "test_the_wall_of_a_crowd_is_on_one_screen_and_its_names_never_overprint",
        f"{BROWSER}/test_crowd.py::"
        "test_a_job_a_plan_and_the_passes_of_a_shift_are_printed_on_two_pages",
        f"{BROWSER}/test_in_the_way.py::test_no_link_and_no_button_is_clipped",
        f"{BROWSER}/test_in_the_way.py::test_a_clock_moves_while_a_job_runs_and_nothing_else_does",
        f"{BROWSER}/test_in_the_way.py::test_enter_selects_in_the_chart_in_the_table_and_in_lists",
    ),
    "14 generated clients have all of it, under sound names": (
        "service/test_generated_client.py::test_a_generated_client_plans_a_mission",
        f"{HERE}::test_the_document_names_things_as_people_do",
    ),
    "15 words are those of operators": (
        f"{HERE}::test_no_text_of_the_pages_is_jargon",
        f"{HERE}::test_solvers_and_their_parameters_say_what_they_do",
        f"{BROWSER}/test_in_the_way.py::test_the_form_speaks_of_solvers_in_operators_words",
    ),
}

# Texts of the first release that users did not understand.
JARGON: Final = (
    r"Certified planning\. exact", r"Not in the paper\.", r"bound \((dp|milp|lagrangian|totals)\)",
    r"\d recorder capacities", r"element sets taken", r"left out for displaced by",
    r"\bNo key\b(?! was)", r"\bA\(s\)", r"N_a max", r"N_sim", r"d_solve", r"\(s\) taken",
)  # fmt: skip


@pytest.fixture(scope="module")
def mission(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Mission]:
    with running(tmp_path_factory.mktemp("impressions")) as mission:
        yield mission


def test_there_is_a_line_for_each_point_and_each_test_that_it_names() -> None:
    assert [int(point.split()[0]) for point in SHOWN_BY] == list(range(1, 16))
    named = [name for names in SHOWN_BY.values() for name in names]
    for file, test in (name.split("::") for name in named):
        tree = ast.parse((TESTS / file).read_text(encoding="utf-8"))
        there = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
        assert test in there, f"{file} has no {test}"
    own = {name.split("::")[1] for name in named if name.startswith(HERE)}
    tree = ast.parse(Path(__file__).read_text(encoding="utf-8"))
    there = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    assert {name for name in there if name.startswith("test_")} - own == {
        "test_there_is_a_line_for_each_point_and_each_test_that_it_names"
    }


def question(client: httpx.Client, targets: list[dict[str, Any]], **fields: Any) -> dict[str, Any]:
    """Return the body of a scenario over these targets."""
    catalog = post(client, "/v1/target-catalogs", {"name": "Points", "targets": targets})
    if "satellite_ids" not in fields:
        fields["satellite_ids"] = [post(client, "/v1/satellites", satellite())["id"]]
    end = EPOCH + timedelta(hours=6)
    return {
        "horizon": {"start": EPOCH.isoformat(), "end": end.isoformat()},
        "target_catalog_ids": [catalog["id"]],
    } | fields


def test_a_recorder_in_the_wrong_unit_is_named_before_the_search(mission: Mission) -> None:
    gigabits = satellite(
        spacecraft="generic_optical", resources={"recorder_capacity_mbit": 20.0}, name="GIGA"
    )
    scenario = asked_of(mission.http, drawn_targets(40), gigabits)
    (warning,) = [one for one in scenario["warnings"] if "larger than the recorder" in one]
    assert "recorder_capacity_mbit" in warning
    job = planned(mission, scenario)
    assert warning in job["warnings"]
    reasons = [one["reason"]["code"] for one in mission.targets(job).values() if one["reason"]]
    assert "recorder" in reasons
    assert set(reasons) <= {"recorder", "no_access"}


def test_an_image_longer_than_its_accesses_is_named_as_the_cause(mission: Mission) -> None:
    targets = [one | {"collect_s": 3600.0} for one in drawn_targets(40)]
    scenario = asked_of(mission.http, targets, satellite(spacecraft="generic_optical"))
    (warning,) = [one for one in scenario["warnings"] if "takes longer than" in one]
    assert f"{targets[0]['id']}" in warning
    assert "collect_s" in warning
    reasons = [one["reason"] for one in mission.targets(planned(mission, scenario)).values()]
    assert {one["code"] for one in reasons} == {"no_access"}
    assert any("shorter than its collect" in one["detail"] for one in reasons)


def asked_of(client: httpx.Client, targets: list[dict[str, Any]], own: dict[str, Any]) -> Document:
    """Return a stored scenario with one station and one satellite."""
    fields = {
        "satellite_ids": [post(client, "/v1/satellites", own)["id"]],
        "ground_station_ids": [post(client, "/v1/ground-stations", ground_station())["id"]],
    }
    return post(client, "/v1/scenarios", question(client, targets, **fields))


def planned(mission: Mission, scenario: Document) -> Document:
    body = {"scenario_id": scenario["id"], "solver": "rule"}
    return mission.ended(mission.http.post("/v1/jobs", json=body))


def test_swapped_latitude_and_longitude_are_told(service: Service) -> None:
    # In eastern Brazil; off Antarctica if swapped.
    places = [(lat, lon) for lat in (-12.0, -9.0, -6.0) for lon in (-62.0, -58.0, -54.0, -50.0)]
    for is_swapped in (False, True):
        rows = [
            target(
                id=f"t{i}", lat_deg=lon if is_swapped else lat, lon_deg=lat if is_swapped else lon
            )
            for i, (lat, lon) in enumerate(places)
        ]
        told = post(service.client, "/v1/scenarios", question(service.client, rows))["warnings"]
        assert any("latitude and longitude swapped" in one for one in told) == is_swapped


@pytest.mark.parametrize(
    ("text", "advice"),
    [
        ("id,lat,lon\na,48,5,-3,25\n", "separate cells with semicolons"),
        ('id,lat,lon\na,"48,5","-3,25"\n', "Write it with a decimal point"),
    ],
)
def test_decimal_commas_between_commas_are_refused_with_what_to_do(
    service: Service, text: str, advice: str
) -> None:
    answer = send(service.client, "/v1/target-catalogs", text, "text/csv")
    problem = assert_problem(answer, 422, answer.json()["code"])
    assert problem["errors"][0]["row"] == 2
    assert advice in problem["errors"][0]["detail"]


def test_a_priority_column_is_told_to_be_ignored(service: Service) -> None:
    text = "id;priority;lat;lon\na;9;48,5;-3,25\n"
    answer = send(service.client, "/v1/target-catalogs", text, "text/csv")
    assert answer.status_code == 201
    assert answer.json()["ignored_columns"] == ["priority"]


def test_all_old_elements_are_named_with_the_setting_that_allows_them(service: Service) -> None:
    client = service.client
    ages_days = {"YOUNG": 1, "STALE": 40, "WORN": 50}
    ids = [
        post(
            client,
            "/v1/satellites",
            satellite(name=name, tle=tle(93_000 + age, epoch=EPOCH - timedelta(days=age))),
        )["id"]
        for name, age in ages_days.items()
    ]
    asked = question(client, [target()], satellite_ids=ids)
    refused = client.post("/v1/scenarios", json=asked)
    problem = assert_problem(refused, 422, "elements_too_old", "/satellite_ids/1")
    assert "2 of 3" in problem["detail"]
    assert all(name in problem["detail"] for name in ("STALE", "WORN"))
    assert "YOUNG" not in problem["detail"]
    assert "allow_old_elements" in problem["detail"]
    assert "allow_old_elements" in client.get("/new").text
    assert client.post("/v1/scenarios", json=asked | {"allow_old_elements": True}).is_success


def test_the_document_names_things_as_people_do() -> None:
    document = contract().document
    operations = [
        operation
        for path in document["paths"].values()
        for operation in path.values()
        if isinstance(operation, dict)
    ]
    names = [operation["operationId"] for operation in operations]
    names += [tag for operation in operations for tag in operation["tags"]]
    names += list(document["paths"]) + list(document["components"]["schemas"])
    # One spelling in identifiers; prose is British.
    assert [name for name in names if "catalogue" in name.lower()] == []
    # A summary that FastAPI derives from a function's name is not good enough.
    made = [
        operation["summary"]
        for operation in operations
        if operation["summary"] == operation["operationId"].replace("_", " ").title()
    ]
    assert made == []


def test_no_text_of_the_pages_is_jargon() -> None:
    dashboard = TESTS.parent / "service" / "dashboard"
    files = [*dashboard.glob("static/*.js"), *dashboard.glob("pages/*.html")]
    assert len(files) > 40
    docs = [*(TESTS.parent / "docs").glob("dashboard.md"), TESTS.parent / "README.md"]
    found = [
        (file.name, hit.group())
        for file in files + docs
        for phrase in JARGON
        for hit in re.finditer(phrase, file.read_text(encoding="utf-8"))
    ]
    assert found == []


def test_solvers_and_their_parameters_say_what_they_do(service: Service) -> None:
    for solver in service.client.get("/v1/solvers").json()["items"]:
        texts = [solver["description"]]
        texts += [one["description"] for one in solver["params_schema"]["properties"].values()]
        for text in texts:
            assert len(text) > 10, (solver["name"], text)
            assert not any(re.search(phrase, text) for phrase in JARGON), text
        assert "paper" not in solver["description"]
