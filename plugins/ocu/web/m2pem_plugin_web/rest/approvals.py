"""/api/missions/{name}/approval: who has approved a mission of the folder, and who must."""

from collections.abc import Mapping

from fastapi import APIRouter

from m2pem.api import Draft, GivenApproval, MissionApproval, MissionControl
from m2pem_plugin_web.access.permissions import Operator, Viewer
from m2pem_plugin_web.missions.folder import MissionFolder
from m2pem_plugin_web.missions.versions import VERSION_LENGTH
from m2pem_plugin_web.problems import RESPONSES
from m2pem_plugin_web.rest.drafts import MissionName, of_folder
from m2pem_plugin_web.rest.models import Answer, Body, Name


class EarlierApprovalModel(Answer):
    """A person has approved an earlier content. `changed`: what is other now. `version`: the number
    of the version that the mission's file was then; null: none of that content is kept."""

    by: str
    at_us: int
    changed: list[str]
    version: int | None


class ApprovalModel(Answer):
    """`MissionApproval`. `digest`: of the content of its files and drawings. `persons`: how many
    the fleet asks for, 0: none; `needed`: how many approvals must count; `missing`: how many more.
    `who`: who must approve it, in words."""

    mission: str
    digest: str
    persons: int
    role: str
    needed: int
    missing: int
    who: str
    editors: list[str]
    editor_unknown: bool
    approvals: list[GivenApproval]
    not_counted: list[GivenApproval]
    earlier: list[EarlierApprovalModel]


class ApproveModel(Body):
    """`digest`: of the content that the person has looked at; another one is not approved."""

    digest: Name


def router(control: MissionControl, folder: MissionFolder) -> APIRouter:
    """The routes of approvals."""
    routes = APIRouter(prefix="/api/missions", tags=["missions"], responses=RESPONSES)

    async def draft(name: str) -> Draft:
        saved = await of_folder(folder.read, name)
        return Draft(saved.path, saved.source)

    async def model(name: str, state: MissionApproval) -> ApprovalModel:
        versions = await of_folder(folder.versions, name) if state.earlier else ()
        return _model(state, {each.version: each.number for each in versions})

    @routes.get("/{name}/approval")
    async def approval(_: Viewer, name: MissionName) -> ApprovalModel:
        """Who has approved a mission, and who must before it may start."""
        return await model(name, await control.approval(await draft(name)))

    @routes.post("/{name}/approval")
    async def approve(person: Operator, name: MissionName, wanted: ApproveModel) -> ApprovalModel:
        """Approve it."""
        found = await draft(name)
        state = await control.approve(found, digest=wanted.digest, by=person.name)
        return await model(name, state)

    @routes.post("/{name}/approval/withdraw")
    async def withdraw(person: Operator, name: MissionName) -> ApprovalModel:
        """Withdraw one's approval. What runs goes on."""
        state = await control.withdraw_approval(await draft(name), by=person.name)
        return await model(name, state)

    return routes


def _model(state: MissionApproval, versions: Mapping[str, int]) -> ApprovalModel:
    earlier = [
        EarlierApprovalModel.of(
            each, version=versions.get(each.file[:VERSION_LENGTH]) if each.file else None
        )
        for each in state.earlier
    ]
    return ApprovalModel.of(state, who=state.who() if state.missing else "", earlier=earlier)
