// The trial that the page shows. Parts that depend on it are told in the order they asked.

export const makeSelection = (first) => {
  let trial = first;
  const listeners = [];
  return {
    get: () => trial,
    set: (id) => {
      trial = id;
      for (const listener of listeners) listener(id);
    },
    /** Calls `listener(id)` now and after every change. */
    follow: (listener) => {
      listeners.push(listener);
      listener(trial);
    },
  };
};
