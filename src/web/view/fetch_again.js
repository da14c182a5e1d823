// What a page needs before it can begin: asked for again when the network, which may be changing just then, did not bring it. No DOM.

const DELAYS_MS = [300, 1000, 3000];

// As fetch(). Rejects when the last try has failed as well.
export async function fetchAgain(address, options) {
  for (const delay of DELAYS_MS) {
    try {
      return await fetch(address, options);
    } catch {
      await new Promise((resolve) => setTimeout(resolve, delay));
    }
  }
  return fetch(address, options);
}
