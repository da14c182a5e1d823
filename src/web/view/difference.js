// How two texts differ, line by line. No DOM.

const MOST_COMPARED = 4_000_000; // pairs of lines

// [{sign, line}]: ' ' is in both, '-' only in `before`, '+' only in `after`; of lines in both only those beside others, and `null` where some
// are left out.
export function difference(before, after, around = 2) {
  const [a, b] = [before, after].map((text) => text.split('\n'));
  let start = 0;
  while (start < a.length && start < b.length && a[start] === b[start])
    start++;
  let end = 0;
  while (end < a.length - start && end < b.length - start && a.at(-1 - end) === b.at(-1 - end))
    end++;
  const same = (lines) => lines.map((line) => ({ sign: ' ', line }));
  const all = [...same(a.slice(0, start)), ...middle(a.slice(start, a.length - end), b.slice(start, b.length - end)), ...same(a.slice(a.length - end))];
  return shorten(all, around);
}

// By the longest common subsequence; where that would take long, all of one and then all of the other.
function middle(a, b) {
  if (a.length * b.length > MOST_COMPARED)
    return [...a.map((line) => ({ sign: '-', line })), ...b.map((line) => ({ sign: '+', line }))];
  const width = b.length + 1;
  const common = new Uint32Array((a.length + 1) * width); // of what is from (i, j) on
  for (let i = a.length - 1; i >= 0; i--) {
    for (let j = b.length - 1; j >= 0; j--)
      common[i * width + j] = a[i] === b[j] ? common[(i + 1) * width + j + 1] + 1 : Math.max(common[(i + 1) * width + j], common[i * width + j + 1]);
  }
  const found = [];
  for (let i = 0, j = 0; i < a.length || j < b.length;) {
    if (i < a.length && j < b.length && a[i] === b[j]) {
      found.push({ sign: ' ', line: a[i++] });
      j++;
    } else if (j === b.length || (i < a.length && common[(i + 1) * width + j] >= common[i * width + j + 1]))
      found.push({ sign: '-', line: a[i++] });
    else
      found.push({ sign: '+', line: b[j++] });
  }
  return found;
}

function shorten(all, around) {
  const isNear = (index) => all.slice(Math.max(0, index - around), index + around + 1).some(({ sign }) => sign !== ' ');
  const shown = [];
  all.forEach((each, index) => {
    if (isNear(index))
      shown.push(each);
    else if (shown.at(-1) !== null)
      shown.push(null);
  });
  return shown;
}
