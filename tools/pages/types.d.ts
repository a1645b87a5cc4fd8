// Types that the pages' comments name, made from those of the server's messages.

import type { Job, Order, Outcome } from "../../docs/messages";

// A message without fields is declared as a record of any name with no value: it adds none here.
type Named<T> = T extends unknown ? (string extends keyof T ? never : T) : never;
type Keys<T> = T extends unknown ? keyof T : never;
type Value<T, K> = T extends unknown ? (K extends keyof T ? T[K] : never) : never;

/** Any of several types, as long as nobody has asked which: each field may be missing. */
export type Loose<T> = { [K in Keys<Named<T>>]?: Value<Named<T>, K> };

/** A finished job of one procedure. */
export type Done<P> = Omit<Job, "order" | "outcome"> & {
  order: Extract<Order, { procedure: P }>;
  outcome: Extract<Outcome, { procedure: P }>;
};

/** A job of any procedure. */
export type AnyJob = Omit<Job, "order" | "outcome"> & {
  order: Loose<Order> & { procedure: string };
  outcome: Loose<Outcome>;
};
