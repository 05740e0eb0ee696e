"""Files: what no reader can read, and what m2pem does not execute."""

from m2pem.bpmn.rules.rule import error, warning

UNREADABLE_FILE = error(
    101,
    "the file cannot be read",
    "name a BPMN 2.0 file",
)
NOT_XML = error(
    102,
    "the file is not well-formed XML",
    "correct it, or export it again from the editor",
)
NOT_BPMN = error(
    103,
    "the file's root is not BPMN 2.0's definitions",
    "export it as BPMN 2.0",
)
DOCTYPE = error(
    104,
    "the file has a document type declaration",
    "delete the <!DOCTYPE ...> declaration; BPMN files need none",
)
ENCODING = error(
    105,
    "the text is not in the encoding that the file says",
    "save the file as UTF-8",
)
TOO_LARGE = error(
    106,
    "the file is larger than the limit (64 MiB)",
    "set M2PEM_MAX_MISSION_MIB",
)
TOO_DEEP = error(
    107,
    "elements nest too deep",
    "move inner subprocesses to processes of their own and call them",
)
NOT_EXECUTED = error(
    110,
    "m2pem does not execute the element yet",
    "draw it with what missions.md lists",
)
UNUSABLE_FILE = error(
    111,
    "a file of the library that a call activity or import names is no BPMN 2.0",
    "export it as BPMN 2.0, or take it out of the search path",
)
IMPORT_UNREADABLE = warning(
    112,
    "a file that is imported cannot be read",
    "correct the import's location, or put the file there",
)
