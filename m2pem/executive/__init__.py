"""The asyncio shell: runs missions, dispatches to arbiters, answers operators."""
