// SPDX-License-Identifier: Apache-2.0

export const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
/** The wall clock in milliseconds with fractions. A page has the same as performance.timeOrigin + performance.now(). */
export const wall_ms = () => performance.timeOrigin + performance.now();

/** Returns the first value of make() that counts as true, or undefined when it took too long. */
export async function until(make, patience_ms = 3000) {
  for (const begin = performance.now(); performance.now() - begin < patience_ms; await sleep(20)) {
    const value = await make();
    if (value) return value;
  }
  return undefined;
}

export const median = (numbers) => [...numbers].sort((a, b) => a - b)[numbers.length >> 1];

/** Prints a row of the evidence page. */
export function row(what, figure, target, met) {
  console.log(`row | ${what} | ${figure} | ${target} | ${met ? 'yes' : 'no'}`);
}
