// What has been drawn and not saved, kept in this browser in case it ends (IndexedDB).
export interface Draft {
  mission: string;
  xml: string;
  /** The version that it was drawn from; null: a new mission. */
  base: string | null;
  at: number;
}

const DATABASE = "m2pem-editor";
const STORE = "drafts";

export async function readDraft(mission: string): Promise<Draft | undefined> {
  return transact("readonly", (store) => store.get(mission) as IDBRequest<Draft | undefined>);
}

export async function writeDraft(draft: Draft): Promise<void> {
  await transact("readwrite", (store) => store.put(draft));
}

export async function dropDraft(mission: string): Promise<void> {
  await transact("readwrite", (store) => store.delete(mission));
}

async function transact<T>(
  mode: IDBTransactionMode,
  act: (store: IDBObjectStore) => IDBRequest<T>,
): Promise<T> {
  const database = await open();
  try {
    return await settled(act(database.transaction(STORE, mode).objectStore(STORE)));
  } finally {
    database.close();
  }
}

function open(): Promise<IDBDatabase> {
  const request = indexedDB.open(DATABASE, 1);
  request.onupgradeneeded = () => {
    request.result.createObjectStore(STORE, { keyPath: "mission" });
  };
  return settled(request);
}

function settled<T>(request: IDBRequest<T>): Promise<T> {
  return new Promise((resolve, reject) => {
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error ?? new Error("the browser keeps nothing"));
  });
}
