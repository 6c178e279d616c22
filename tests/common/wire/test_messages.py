from __future__ import annotations

import msgspec
import pytest

from farhand.common.mode_table import ControlMode, Phase
from farhand.common.wire.codec import decode, encode
from farhand.common.wire.messages import MAX_TELEMETRY_BYTES, SCHEMA, ArmState, Stamp, Telemetry
from tests.messages import all_kinds


def largest(position: tuple[float, ...]) -> Telemetry:
    """A report in the middle of an execution after weeks, every field at its longest."""
    return Telemetry(
        seq=2**32 - 1, stamp=Stamp("deadbeef", 2**53), mode=ControlMode.AUTONOMOUS, phase=Phase.APPROACHING,
        position_m=position, frame_origin_m=position, frame_rotation_rad=position, component=255,
        elapsed_s=1234.5, path_id=65_535, model="deadbeef", coupling_id=127, holder="operator-north-1",
        lease="beef", heartbeat_echo=2**32 - 1, heartbeat_held_ms=99.9, stale_refused=65_535,
    )  # fmt: skip


def test_telemetry_in_space_fits_into_its_bytes_at_its_largest():
    point = largest((0.1, -0.2, 0.3))
    assert len(encode(point)) <= 200
    turn = (0.1, -0.2, 0.3)
    arm = msgspec.structs.replace(point, arm=ArmState(turn, (*turn, *turn, 0.4, -0.5), 123.4, 65_535))
    assert len(encode(arm)) <= MAX_TELEMETRY_BYTES


def test_telemetry_in_the_plane_travels_in_single_precision():
    report = decode(encode(largest((0.1, 0.2))), Telemetry)
    assert report.position_m == pytest.approx((0.1, 0.2), rel=1e-6)
    assert report.position_m != (0.1, 0.2)


@pytest.mark.parametrize("kind", all_kinds(), ids=lambda kind: kind.__name__)
def test_every_message_carries_the_schema_and_allows_no_unknown_field(kind):
    fields = {field.name: field for field in msgspec.structs.fields(kind)}
    assert fields["schema"].default == SCHEMA
    assert kind.__struct_config__.forbid_unknown_fields and kind.__struct_config__.frozen
