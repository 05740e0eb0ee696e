from m2pem.api.async_queue import AsyncQueue
from m2pem.api.clock import VirtualClock, run_virtual


def test_what_waits_is_read_after_closing_and_nothing_more_comes_in() -> None:
    async def main(_: VirtualClock) -> None:
        mailbox: AsyncQueue[int] = AsyncQueue()
        mailbox.put(1)
        mailbox.put(2)
        mailbox.close()
        mailbox.put(3)
        assert [item async for item in mailbox.read()] == [1, 2]

    run_virtual(main, 0)


def test_a_full_mailbox_drops_the_oldest_that_may_go() -> None:
    async def main(_: VirtualClock) -> None:
        mailbox: AsyncQueue[int] = AsyncQueue(3, lambda item: item % 2 == 0)
        for item in (1, 2, 3, 4, 5, 6):
            mailbox.put(item)
        mailbox.close()
        assert [item async for item in mailbox.read()] == [1, 3, 5, 6]

    run_virtual(main, 0)
