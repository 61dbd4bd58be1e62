"""Universal Scene Description (.usd .usda .usdc .usdz) by usd-core: what is visible and meant for rendering.

Polygons, normals, UV sets, prim and material names, instances and point instancers; up axis and unit are in the
transforms. Skins and blend shapes are applied at the stage's first time. Subdivision surfaces are taken as their cages.
"""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stages.core.errors import InputError, one_line
from stages.prep.extras import package
from stages.prep.pieces import Indexed, Piece, joined
from stages.prep.source import Source

_UV_NAMES = ("st", "uv", "map")  # of sets that do not say they are texture coordinates
_SHAPES = ("Cube", "Sphere", "Cylinder", "Cylinder_1", "Cone", "Capsule", "Capsule_1", "Plane", "NurbsPatch", "BasisCurves",
           "NurbsCurves", "HermiteCurves", "Points", "TetMesh", "Volume")  # fmt: skip

_Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])  # +z to +y


def read_usd(path: Path) -> Source:
    """Read a USD stage. Raises: InputError."""
    scene = _Scene(path)
    try:
        pieces = list(scene.pieces())
        return joined("usd", pieces, scene.skipped, scene.applied, path)
    except (scene.pxr.Tf.ErrorException, ValueError, TypeError, RuntimeError) as error:
        raise InputError(f"{path}: is not a sound USD stage ({one_line(error)}); export it again") from None


def layers(path: Path) -> dict[str, Path]:
    """Files beside the stage's own that it is composed of: name -> path. Raises: InputError."""
    scene = _Scene(path)
    files = [Path(layer.realPath) for layer in scene.stage.GetUsedLayers() if layer.realPath]
    return {file.name: file for file in files if file.is_file() and file.resolve() != path.resolve()}


class _Scene:
    """An open stage and what is counted while it is walked."""

    def __init__(self, path: Path) -> None:
        for module in ("Gf", "Tf", "Usd", "UsdGeom", "UsdShade", "UsdSkel", "UsdUtils"):
            package(f"pxr.{module}", "usd", "USD", path)
        self.pxr: Any = sys.modules["pxr"]
        self.skipped: dict[str, int] = {}
        self.applied: dict[str, int] = {}
        self.quiet = self.pxr.UsdUtils.CoalescingDiagnosticDelegate()  # its warnings go nowhere: what matters is counted
        try:
            self.stage = self.pxr.Usd.Stage.Open(str(path))
        except self.pxr.Tf.ErrorException as error:
            raise InputError(f"{path}: cannot be read as USD ({one_line(error)}); export it again") from None
        self.time = self.pxr.Usd.TimeCode.EarliestTime()
        self.count("references_that_cannot_be_found", len(self.stage.GetCompositionErrors()))

    def count(self, what: str, count: int = 1, of: str = "skipped") -> None:
        if count:
            counts = getattr(self, of)
            counts[what] = counts.get(what, 0) + count

    def pieces(self) -> Iterator[Piece]:
        """Each mesh that a renderer would show."""
        geom = self.pxr.UsdGeom
        self._pose()
        self.places = geom.XformCache(self.time)
        unit = geom.GetStageMetersPerUnit(self.stage)
        upright = _Z_UP if geom.GetStageUpAxis(self.stage) == geom.Tokens.z else np.eye(4)
        self.frame = np.diag([unit, unit, unit, 1.0]) @ upright
        yield from self._below(self.stage.GetPseudoRoot(), np.eye(4))

    def _pose(self) -> None:
        """Apply skins and blend shapes, in the session layer, which is never saved."""
        skeletal = self.pxr.UsdSkel
        roots = [prim for prim in self.stage.Traverse() if prim.IsA(skeletal.Root)]
        if not roots:
            return
        start = self.stage.GetStartTimeCode() if self.stage.HasAuthoredTimeCodeRange() else 0.0
        self.stage.SetEditTarget(self.stage.GetSessionLayer())
        for root in roots:
            done = skeletal.BakeSkinning(skeletal.Root(root), self.pxr.Gf.Interval(start, start))
            self.count("skins_in_their_first_pose" if done else "skins", of="applied" if done else "skipped")

    def _below(self, top: Any, moved: NDArray, among_prototypes: bool = False) -> Iterator[Piece]:
        """Pieces of a subtree. moved: (4, 4) what its places in the stage are multiplied by."""
        usd, geom = self.pxr.Usd, self.pxr.UsdGeom
        walk = iter(usd.PrimRange(top, usd.TraverseInstanceProxies(usd.PrimDefaultPredicate)))
        for prim in walk:
            if prim.IsA(geom.PointInstancer) and not (among_prototypes and prim == top):
                walk.PruneChildren()
                if self._is_shown(prim):
                    yield from self._instances(geom.PointInstancer(prim), moved)
            elif prim.IsA(geom.Mesh):
                if self._is_shown(prim):
                    yield self._mesh(geom.Mesh(prim), self.frame @ moved @ self._place(prim))
            elif prim.GetTypeName() in _SHAPES and self._is_shown(prim):
                self.count(f"usd_{str(prim.GetTypeName()).lower()}")

    def _is_shown(self, prim: Any) -> bool:
        imageable = self.pxr.UsdGeom.Imageable(prim)
        if imageable.ComputeVisibility(self.time) == "invisible":
            self.count("hidden_nodes")
            return False
        if imageable.ComputePurpose() in ("proxy", "guide"):
            self.count("proxies_and_guides")
            return False
        return True

    def _place(self, prim: Any) -> NDArray[np.float64]:
        return np.array(self.places.GetLocalToWorldTransform(prim)).T  # USD's points are rows

    def _instances(self, instancer: Any, moved: NDArray) -> Iterator[Piece]:
        """Each prototype's pieces at each of its places."""
        place = self._place(instancer.GetPrim())
        turns = instancer.ComputeInstanceTransformsAtTime(self.time, self.time)
        prototypes = [self.stage.GetPrimAtPath(target) for target in instancer.GetPrototypesRel().GetTargets()]
        which = instancer.GetProtoIndicesAttr().Get(self.time) or []
        mask = instancer.ComputeMaskAtTime(self.time)
        which = [index for k, index in enumerate(which) if not mask or mask[k]]
        self.count("instances", len(which), "applied")
        for index, turn in zip(which, turns or [], strict=False):
            prototype = prototypes[index]
            own = np.linalg.inv(self._place(prototype))
            yield from self._below(prototype, moved @ place @ np.array(turn).T @ own)

    def _mesh(self, mesh: Any, transform: NDArray) -> Piece:
        prim = mesh.GetPrim()
        lengths = np.array(mesh.GetFaceVertexCountsAttr().Get(self.time) or [], np.int64)
        corner = np.array(mesh.GetFaceVertexIndicesAttr().Get(self.time) or [], np.int64)
        positions = np.array(mesh.GetPointsAttr().Get(self.time) or np.zeros((0, 3)), np.float64).reshape(-1, 3)
        if mesh.GetSubdivisionSchemeAttr().Get() != "none" and mesh.GetSubdivisionSchemeAttr().HasAuthoredValue():
            self.count("subdivision_levels")
        materials, face_material = self._slots(prim, len(lengths))
        uv = [found for primvar in self._uv_primvars(prim) if (found := self._indexed(primvar, corner, lengths))]
        alone = prim.GetParent().GetTypeName() == "Xform" and len(prim.GetParent().GetAllChildren()) == 1
        node = prim.GetParent() if alone else prim  # Blender writes an object as an Xform with its mesh below
        piece = Piece(str(prim.GetName()), str(node.GetName()), transform, positions, lengths, corner, materials,
                      face_material, self._normals(mesh, corner, lengths), uv)  # fmt: skip
        return _turned(piece) if mesh.GetOrientationAttr().Get() == "leftHanded" else piece

    def _slots(self, prim: Any, faces: int) -> tuple[list[str], NDArray[np.int64]]:
        """Names of the materials of a mesh, and the row of each face's: its subset's, or the mesh's own."""
        shade = self.pxr.UsdShade

        def bound(to: Any) -> str:
            material, _ = shade.MaterialBindingAPI(to).ComputeBoundMaterial()
            return str(material.GetPrim().GetName()) if material else ""

        names, rows = [bound(prim)], np.zeros(faces, np.int64)
        for subset in shade.MaterialBindingAPI(prim).GetMaterialBindSubsets():
            mine = np.array(subset.GetIndicesAttr().Get(self.time) or [], np.int64)
            rows[mine[(mine >= 0) & (mine < faces)]] = len(names)
            names.append(bound(subset.GetPrim()) or str(subset.GetPrim().GetName()))
        return names, rows

    def _uv_primvars(self, prim: Any) -> list[Any]:
        """Texture coordinates, the one called st first, then in the order of their names."""
        found = []
        for primvar in self.pxr.UsdGeom.PrimvarsAPI(prim).GetPrimvarsWithValues():
            kind, name = primvar.GetTypeName(), str(primvar.GetPrimvarName())
            if kind.role == "TextureCoordinate" or (str(kind).startswith(("float2[", "double2[", "half2["))
                                                    and name.lower().startswith(_UV_NAMES)):  # fmt: skip
                found.append((name != "st", name, primvar))
        return [primvar for _, _, primvar in sorted(found, key=lambda entry: entry[:2])]

    def _normals(self, mesh: Any, corner: NDArray, lengths: NDArray) -> Indexed | None:
        primvar = self.pxr.UsdGeom.PrimvarsAPI(mesh.GetPrim()).GetPrimvar("normals")
        if primvar and primvar.HasValue():
            return self._indexed(primvar, corner, lengths)
        values = mesh.GetNormalsAttr().Get(self.time)
        return _by_corner(values, None, str(mesh.GetNormalsInterpolation()), corner, lengths) if values else None

    def _indexed(self, primvar: Any, corner: NDArray, lengths: NDArray) -> Indexed | None:
        values = primvar.Get(self.time)
        indices = primvar.GetIndices(self.time) if primvar.IsIndexed() else None
        return _by_corner(values, indices, str(primvar.GetInterpolation()), corner, lengths) if values else None


def _by_corner(values: Any, indices: Any, interpolation: str, corner: NDArray, lengths: NDArray) -> Indexed:
    """Values and the row of each corner (USD's four ways of interpolation)."""
    place = {
        "faceVarying": np.arange(len(corner)), "uniform": np.repeat(np.arange(len(lengths)), lengths),
        "constant": np.zeros(len(corner), np.int64),
    }.get(interpolation, corner)  # fmt: skip
    if indices is not None:
        table = np.array(indices, np.int64)
        inside = (place >= 0) & (place < len(table))
        place = np.where(inside, table[np.clip(place, 0, max(len(table) - 1, 0))] if len(table) else -1, -1)
    return np.array(values, np.float64), place


def _turned(piece: Piece) -> Piece:
    """The piece with the corners of each face the other way round, its first one kept."""
    end = np.repeat(np.cumsum(piece.lengths), piece.lengths)
    start = end - np.repeat(piece.lengths, piece.lengths)
    within = np.arange(len(piece.corner)) - start
    order = np.where(within == 0, start, end - within)
    normals = (piece.normals[0], piece.normals[1][order]) if piece.normals else None
    return Piece(
        piece.name, piece.node, piece.transform, piece.positions, piece.lengths, piece.corner[order], piece.materials,
        piece.face_material, normals, [(values, rows[order]) for values, rows in piece.uv],
    )  # fmt: skip
