"""Files: what no reader can read, and what m2pem does not execute."""

from m2pem.bpmn.rules.rule import E, Rule, W

UNREADABLE_FILE = Rule(
    101,
    "unreadable-file",
    "missions.md",
    E,
    "the file cannot be read",
    "name a BPMN 2.0 file",
)
NOT_XML = Rule(
    102,
    "not-xml",
    "missions.md",
    E,
    "the file is not well-formed XML",
    "correct it, or export it again from the editor",
)
NOT_BPMN = Rule(
    103,
    "not-bpmn",
    "missions.md",
    E,
    "the file's root is not BPMN 2.0's definitions",
    "export it as BPMN 2.0",
)
DOCTYPE = Rule(
    104,
    "doctype",
    "missions.md",
    E,
    "the file has a document type declaration",
    "delete it; BPMN files need none",
)
ENCODING = Rule(
    105,
    "encoding",
    "missions.md",
    E,
    "the text is not in the encoding that the file says",
    "save the file as UTF-8",
)
TOO_LARGE = Rule(
    106,
    "too-large",
    "missions.md",
    E,
    "the file is larger than the limit (64 MiB)",
    "set M2PEM_MAX_MISSION_MIB",
)
TOO_DEEP = Rule(
    107,
    "too-deep",
    "missions.md",
    E,
    "elements nest too deep",
    "call processes instead of nesting subprocesses",
)
NOT_EXECUTED = Rule(
    110,
    "not-executed",
    "missions.md",
    E,
    "m2pem does not execute the element yet",
    "draw it with what missions.md lists",
)
UNUSABLE_FILE = Rule(
    111,
    "unusable-file",
    "missions.md",
    E,
    "a file of the library that a call activity or import names is no BPMN 2.0",
    "export it as BPMN 2.0, or take it out of the search path",
)
IMPORT_UNREADABLE = Rule(
    112,
    "import-unreadable",
    "missions.md",
    W,
    "a file that is imported cannot be read",
    "correct the import's location, or put the file there",
)
