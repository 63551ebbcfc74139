#!/usr/bin/python3
"""Places a mark where the wearer's camera looks: a click in the newest picture, by a program."""
import argparse
import sys
import time
import uuid

import grpc

from saccade.v1 import annotation_pb2, annotation_pb2_grpc, geometry_pb2, session_pb2
from saccade.v1 import session_pb2_grpc, tracking_pb2

DEADLINE_S = 5.0  # of one call


def wait_for_tracking(session, limit_s):
    """Until the camera is tracked; a click in any other picture has no place in the world."""
    end = time.monotonic() + limit_s
    while True:
        status = session.GetStatus(session_pb2.GetStatusRequest(), timeout=DEADLINE_S)
        if status.pose.status == tracking_pb2.TRACKING_STATUS_TRACKING:
            return
        if time.monotonic() >= end:
            raise TimeoutError(f"not tracking after {limit_s:.0f} s: {status.pose.advice}")
        time.sleep(0.2)


def place(channel, text, pixel):
    """Makes a cube with `text` at `pixel` (u, v) of the newest picture; None: its middle."""
    session = session_pb2_grpc.SessionServiceStub(channel)
    joined = session.Join(
        session_pb2.JoinRequest(display_name="place_mark", role=session_pb2.ROLE_EXPERT),
        timeout=DEADLINE_S,
    )
    wait_for_tracking(session, limit_s=20)
    # The pixel is one of a named frame, so that it means the same however late it arrives.
    frame = session.GetFrame(session_pb2.GetFrameRequest(), timeout=DEADLINE_S)
    size = frame.intrinsics
    u, v = pixel or (0.5 * (size.width_px - 1), 0.5 * (size.height_px - 1))
    draft = annotation_pb2.AnnotationDraft(
        shape=annotation_pb2.ANNOTATION_SHAPE_CUBE,
        text=text,
        target=annotation_pb2.AnnotationTarget(
            frame_pixel=annotation_pb2.FramePixel(
                frame_id=frame.frame_id, pixel=geometry_pb2.Pixel(u=u, v=v)
            )
        ),
    )
    answer = annotation_pb2_grpc.AnnotationServiceStub(channel).Create(
        # The same request_id again, after a lost answer, makes no second mark.
        annotation_pb2.CreateAnnotationRequest(
            request_id=str(uuid.uuid4()), session_id=joined.session_id, draft=draft
        ),
        timeout=DEADLINE_S,
    )
    return frame.frame_id, answer.annotation


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--server", default="127.0.0.1:50051", help="HOST:PORT (%(default)s)")
    parser.add_argument("--text", default="here", help="what the mark says (%(default)s)")
    parser.add_argument("--pixel", nargs=2, type=float, metavar=("U", "V"), help="the middle")
    arguments = parser.parse_args()
    try:
        with grpc.insecure_channel(arguments.server) as channel:
            frame_id, mark = place(channel, arguments.text, arguments.pixel)
    except grpc.RpcError as error:
        # The server's words name the field and the remedy.
        sys.exit(f"place_mark: {error.code().name}: {error.details()}")
    except TimeoutError as error:
        sys.exit(f"place_mark: {error}")
    point = mark.anchor.point_in_world_m
    state = annotation_pb2.AnchorState.Name(mark.anchor.state).removeprefix("ANCHOR_STATE_")
    print(
        f"frame {frame_id} mark {mark.id} at {point.x:.3f} {point.y:.3f} {point.z:.3f} "
        f"error {mark.anchor.error_mm:.0f} mm {state.lower()}"
    )


if __name__ == "__main__":
    main()
