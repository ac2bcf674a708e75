# SPDX-License-Identifier: Apache-2.0
"""The client for asyncio: the same calls, and both are the same code."""

import asyncio
import inspect

import numpy as np
import pytest
import shapedb

import solids
from conftest import QUICK


def test_a_walk_through(client, tmp_path):
    async def main():
        async with shapedb.AsyncClient(client.address) as other:
            assert await other.health() == "serving"
            tools = await other.create_collection("tools", parameters=QUICK)
            scans = {"hammer": solids.hammer(), "egg": solids.ball(axes=(1, 1, 2)), "box": solids.box()}
            await asyncio.gather(*(tools.add(key, scan, wait=True) for key, scan in scans.items()))
            assert sorted([shape.key async for shape in tools.shapes(page_size=1)]) == ["box", "egg", "hammer"]
            results = await asyncio.gather(*(tools.search(scan, k=1) for scan in scans.values()))
            assert [result[0].key for result in results] == list(scans)
            assert (await tools.wait("box")).state == "ready" and (await tools.wait_until_ready()).ready == 3
            np.testing.assert_array_equal(await tools.points("egg"), scans["egg"].astype(np.float32))
            assert len((await other.segment(solids.hammer())).points) == len(solids.hammer())
            report = await other.backup(tmp_path / "all.sqlite")
            assert report.bytes == (tmp_path / "all.sqlite").stat().st_size
            assert (await other.restore(tmp_path / "all.sqlite")).shapes == 3
            assert (await tools.rebuild())[0].finished
            with pytest.raises(shapedb.ShapeDBError, match="not_found"):
                await tools.get("none")
            with pytest.raises(shapedb.InvalidInput, match="too_few_points"):
                await tools.search([])

    asyncio.run(main())


def test_closing_ends_the_calls_of_other_tasks(client):
    async def main():
        other = shapedb.AsyncClient(client.address)
        waiting = asyncio.create_task(other.collection("slow").wait_until_ready())
        await other.create_collection("slow", parameters=QUICK)
        watching = asyncio.create_task(other.segment(solids.hammer(200_000)))
        await asyncio.sleep(0.2)
        await other.close()
        done = await asyncio.gather(waiting, watching, return_exceptions=True)
        return [getattr(one, "reason", None) for one in done]

    assert asyncio.run(main())[1] == "cancelled"


def test_a_client_closed_makes_no_calls(client):
    async def main():
        other = shapedb.AsyncClient(client.address)
        await other.collection().count()
        await other.close()
        await other.collection().count()

    with pytest.raises(shapedb.ShapeDBError, match="cancelled"):
        asyncio.run(main())


@pytest.mark.parametrize("blocking, other", [(shapedb.Client, shapedb.AsyncClient),
                                             (shapedb.Collection, shapedb.AsyncCollection)])
def test_both_have_the_same_calls(blocking, other):
    def calls(cls):
        return {name: str(inspect.signature(member)).replace("Async", "")
                for name, member in vars(cls).items() if callable(member) and not name.startswith("__")}

    assert calls(blocking) == calls(other)


def test_every_public_name_is_documented():
    missing = []
    for name in shapedb.__all__:
        value = getattr(shapedb, name)
        if inspect.isclass(value) or inspect.isfunction(value):
            missing += [] if inspect.getdoc(value) else [name]
        for member_name, member in vars(value).items() if inspect.isclass(value) else ():
            if not member_name.startswith("_") and callable(member) and not inspect.getdoc(member):
                missing.append(f"{name}.{member_name}")
    assert not missing
    assert sorted(shapedb.__all__) == sorted(set(shapedb.__all__))
