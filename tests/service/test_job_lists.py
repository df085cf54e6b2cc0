"""The time for a list of jobs depends on its page, not on the number of jobs."""

from __future__ import annotations

import pytest
import sqlalchemy as sa

from service.db.rows import JobRow
from service.stores.finding import with_values
from tests.service.conftest import Service


@pytest.mark.parametrize("column", ["state", "scenario_id", "label", "tenant"])
def test_a_filtered_list_is_read_in_order_from_an_index(service: Service, column: str) -> None:
    page = sa.select(JobRow).where(*with_values(JobRow, **{column: "x"}), JobRow.id < "y")
    text = (
        page.order_by(JobRow.id.desc())
        .limit(51)
        .compile(service.database.engine, compile_kwargs={"literal_binds": True})
    )
    with service.database.reading() as session:
        steps = session.execute(sa.text(f"EXPLAIN QUERY PLAN {text}")).mappings()
        plan = [step["detail"] for step in steps]
    assert plan == [f"SEARCH job USING INDEX ix_job_{column}_id ({column}=? AND id<?)"]
