// The sentences of Python servers, which send no codes: the only ones that pages know. They stay as they are, as those servers do
// (docs/protocol.md, 2.1, 4.1.2, 6.3, 6.5). tests/support/python_refusals.json has them all. No DOM.

const SENTENCES = [
  [/^no simulation server available/i, 'no-machine'],
  [/^(?:Wrong Webots simulation URL|Missing (?:blob|worlds folder|world file) in Webots)/, 'no-address'],
  [/^(?:Docker not enabled|This simulation server is not configured to share|Cannot run simulation from blocked)/, 'not-allowed'],
  [/^Cannot share idle time when/, 'busy'],
  [/^(?<file>.+) does not exist\.$/, 'no-world'],
  [/^Unable to start Webots: (?<why>.+)$/s, 'not-started'],
  [/^Image version \S+ not available/, 'image'],
  [/^Missing \S+ in \//, 'server-fault']
];

// What a server of ours would have sent: {code, values}. Null: no such sentence.
export function reasonOf(sentence) {
  for (const [pattern, code] of SENTENCES) {
    const match = pattern.exec(sentence);
    if (match !== null)
      return { code, values: { ...match.groups } };
  }
  return null;
}
