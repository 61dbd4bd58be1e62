"""Options of `dreammat train prior`."""

from dataclasses import dataclass


@dataclass(frozen=True)
class TrainPriorOptions:
    """What the embedded prior is trained with."""

    steps: int = 4000  # optimiser steps, the text encoder's own first ones included
    text_steps: int = 500  # first steps, that train the text encoder alone on captions and mean materials
    batch: int = 32  # pictures a step
    learning_rate: float = 6e-4  # of Adam, after warming up
    shards: int = 40  # files of light transport
    tiles: int = 40  # pictures in each shard
    seed: int = 0
    device: str = "cpu"  # a torch device
    workers: int = 0  # processes that make batches; 0: the training process itself
    checkpoint_every: int = 60  # steps
    sample_every: int = 600  # steps between sample sheets
