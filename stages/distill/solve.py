"""What a pixel is made of, found from that pixel alone: the material that explains its radiance under all lights.

Five lights of three channels each are fifteen equations for the five values of a material, and pictures of a known model
have no noise: nearly everywhere just one material answers them exactly, and what remains is to find it. Radiance is linear in
the albedo once roughness and metallic are given. So all pairs of a grid are tried, each with its best albedo, and the deepest
hollows of what they leave unexplained are followed to the ground.

Where several materials explain a pixel equally well, the duller is taken, and a pixel says how far it is to be trusted: in a
crevice that no light reaches, or for a mirror that shows nothing but black, its neighbours know better.

Sources: Levenberg 1944, "A method for the solution of certain non-linear problems in least squares"; Marquardt 1963.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from stages.core.shading import Transport

UNSURE = 1e-5
"""Mean squared residual, in nepers of radiance for a unit step of material, under which a direction counts as not seen."""

DOUBT = 0.1
"""What is left unexplained counts as that much of it, too."""


@dataclass(frozen=True)
class Solved:
    """Materials of P points. material: (P, 5). misfit: (P,) mean squared residual in nepers of radiance. trust: (P, 5, 5)
    symmetric, which takes a step towards the material to the part of it that the pictures vouch for."""

    material: Tensor
    misfit: Tensor
    trust: Tensor


def solved(transport: Transport, radiance: Tensor, floor: Tensor) -> Solved:
    """The material of points from their radiance.

    Args:
        transport: P L rows, all lights of a point after each other. radiance: (P, L, 3). floor: (L,) radiance at which the
        logarithmic scale turns linear.
    """
    from stages.distill import solve_kernels  # compiled code is loaded on first use

    shape = radiance.shape[:2]
    light = tuple(t.float().unflatten(0, shape).numpy() for t in (transport.E, transport.A, transport.B, transport.cosine))
    material, misfit, normal = map(torch.from_numpy, solve_kernels.solve(light, radiance.numpy(), floor.numpy()))
    damped = normal + torch.diag_embed((UNSURE + DOUBT * misfit)[:, None].expand(-1, 5))
    return Solved(material.float(), misfit.float(), torch.linalg.solve(damped, normal).float())
