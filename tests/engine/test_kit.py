"""The kit itself: a whole trace, so that the words of the other tests are known."""

from tests.engine.kit import Play
from tests.engine.trace import table


def test_a_whole_run_reads_like_a_table() -> None:
    play = Play("""
        <startEvent id="start"/>
        <userTask id="ask">ask yes no</userTask>
        <exclusiveGateway id="which" default="no"/>
        <scriptTask id="drive">do drive_stop evsg1</scriptTask>
        <endEvent id="end"/>
        start -> ask -> which
        yes: which -> drive if user.decision == 'yes'
        no: which -> end
        drive -> end
    """).start()
    assert play.trace() == table("""
        begin MAIN; open MAIN
        enter start; leave start; take f1
        enter ask; ask p1 ask
    """)
    assert play.orders() == ["open p1 yes no"]
    assert play.answer("yes").trace() == table("""
        answer p1 yes; write user.decision = yes
        leave ask; take f2
        enter which; leave which; take yes
        enter drive; request b1 drive_stop evsg1
    """)
    assert play.orders() == ["close p1 yes", "start b1 drive_stop evsg1"]
    assert play.at == "drive"
    assert play.report("drive").trace() == table("""
        ended b1 SUCCEEDED; leave drive; take f5
        enter end; leave end
        close MAIN; end completed
    """)
    assert play.ended == "completed"
    assert play.detail == ""
