"""Poses of markers from the light of their pattern: lock-in images, a light model, and fits that know their errors.

- `led_clock`: when the LED of a track switches, from the packets that were read.
- `lock_in`: the image of a plate from the events that follow these edges.
- `light_model`, `response`: what a plate in a pose should give.
- `starts`, `fit`, `search`: the poses that explain an image, with covariances and odds.
- `estimate`: the whole way from events and sightings to a `PoseEstimate`.
"""

from bicode_lab.pose.estimate import estimate_pose, pose_of_image
from bicode_lab.pose.led_clock import LedClock, fit_clock
from bicode_lab.pose.lock_in import LockIn, lock_in
from bicode_lab.pose.response import LightPriors
from bicode_lab.pose.result import POSE_REASONS, PlatePose, PoseEstimate, PoseReason
from bicode_lab.pose.settings import PoseSettings

__all__ = [
    "POSE_REASONS",
    "LedClock",
    "LightPriors",
    "LockIn",
    "PlatePose",
    "PoseEstimate",
    "PoseReason",
    "PoseSettings",
    "estimate_pose",
    "fit_clock",
    "lock_in",
    "pose_of_image",
]
