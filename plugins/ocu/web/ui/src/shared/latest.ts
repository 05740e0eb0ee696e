// Questions that change faster than they are answered: one at a time is asked, always the newest,
// and answers to older ones do not count.
export interface Answered<Answer> {
  answer(answer: Answer): void;
  failed(error: unknown): void;
}

export class Latest<Question, Answer> {
  private timer: ReturnType<typeof setTimeout> | undefined;
  private next: { question: Question } | undefined;
  private isAsking = false;
  private isOver = false;

  constructor(
    private readonly ask: (question: Question) => Promise<Answer>,
    private readonly to: Answered<Answer>,
    private readonly pause_ms: number,
  ) {}

  /** Asks after a pause in which nothing else is to be asked. */
  soon(question: Question): void {
    this.next = { question };
    clearTimeout(this.timer);
    this.timer = setTimeout(() => void this.go(), this.pause_ms);
  }

  /** Nothing is to be asked any more, and no answer counts. */
  clear(): void {
    clearTimeout(this.timer);
    this.next = undefined;
    this.cleared += 1;
  }

  end(): void {
    this.clear();
    this.isOver = true;
  }

  private cleared = 0;

  private async go(): Promise<void> {
    if (this.isAsking || !this.next) return;
    const { question } = this.next;
    const { cleared } = this;
    this.next = undefined;
    this.isAsking = true;
    const isNewest = () => !this.isOver && !this.next && cleared === this.cleared;
    try {
      const answer = await this.ask(question);
      if (isNewest()) this.to.answer(answer);
    } catch (error) {
      if (isNewest()) this.to.failed(error);
    } finally {
      this.isAsking = false;
    }
    if (this.next && !this.isOver) await this.go();
  }
}
