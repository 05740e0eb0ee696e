"""What the author of the fastest checker of BPMN says that it takes.

rust_bpmn_analyzer (https://github.com/timKraeuter/rust_bpmn_analyzer), on a Ryzen 7 7700X.
`blocks` are of its own model files, and so is `17x1, reduced`.
"""

PUBLISHED_MS = {
    "10x1": "3",
    "15x1": "161",
    "16x1": "360",
    "17x1": "790; reduced 1.3",
    "20x1": "8,800",
    "5x5": "14",
    "3x20": "11",
    "500 blocks": "9",
}
