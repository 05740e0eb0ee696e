"""What `import m2pem` offers to scripts and notebooks (docs/python.md).

Each function does what the command of the same name does, with the same code and the same findings.
`m2pem` loads them when they are asked for.
"""
