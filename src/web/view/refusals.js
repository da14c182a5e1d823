// What servers say when they refuse or end something, in words for the person who reads it, and what to do. The servers' own
// sentences are part of the protocol, and stay as they are (docs/protocol.md, 2.1, 4.1.2, 4.1.3, 6.5). No DOM.

import { say } from './texts.js';

// The first that fits counts. What is not here is for authors of pages, or comes from another server: it is shown as it is.
const TABLE = [
  [/^no simulation server available/i, () => say('refusal.noMachine')],
  [/^(?:too many sessions are asked for|Too many simulations were started in the last minute)/i, () => say('refusal.tooFast')],
  [/^Too many open connections/, () => say('refusal.full')],
  [/^Your network has (\d+) simulations/, ([, count]) => say('refusal.yourNetwork', { count })],
  [/^This simulation server is (?:about to stop|being stopped)/, () => say('refusal.serverStops')],
  [/^Unsupported URL protocol: .*The URL must start with (.+)$/, ([, sites]) => say('refusal.otherSite', { sites })],
  [/^(?:Wrong Webots simulation URL|Missing (?:blob|worlds folder|world file) in Webots)/, () => say('refusal.noAddress')],
  [/^(?:Docker not enabled|This simulation server is not configured to share|Cannot run simulation from blocked)/,
    () => say('refusal.notAllowed')],
  [/^Cannot share idle time when/, () => say('refusal.busy')],
  [/^Repository (.+) does not exist or is private/, ([, name]) => say('refusal.noRepository', { name })],
  [/^Repository (.+?) has no (?:branch or tag|such commit|folder)/, ([, name]) => say('refusal.notThere', { name })],
  [/^There is no project (.+) with a folder "worlds"/, ([, name]) => say('refusal.noProject', { name })],
  [/No space left on device/, () => say('refusal.diskFull')],
  [/^(?!Unable to start Webots).*(?:This server can't|Permission denied|Read-only file system|Input\/output error|Too many open files|Cannot allocate memory)/,
    ({ input }) => say('refusal.serverFault', { why: input })],
  [/^(.+?) can't be reached: .*Try again later\.$/, ([, site]) => say('refusal.siteUnreachable', { site })],
  [/^The (?:project (?:is larger|has more than|has a file|has folders|took too long)|project's archive|large files)/,
    ({ input }) => say('refusal.badProject', { why: input })],
  [/^Wrong line in webots\.yml/, ({ input }) => say('refusal.badProject', { why: input })],
  [/^This simulation server can't run the project: it lacks what webots\.yml asks for: (.+?)\. Please/,
    ([, labels]) => say('refusal.lacks', { labels })],
  [/^(?:Bad ZIP file|Failed to download project)/, ({ input }) => say('refusal.website', { why: input })],
  [/^The project has to wait/, () => say('refusal.fetchWaits')],
  [/^(.+) does not exist\.$/, ([, file]) => say('refusal.noWorld', { file })],
  [/^Unable to start Webots: (.+)$/s, ([, why]) => say('refusal.notStarted', { why })],
  [/^Webots (?:did not load the world within|loaded the world but opened no port)/, () => say('refusal.tooSlow')],
  [/^Webots has quit\.$/, () => say('refusal.quit')],
  [/^Webots has quit unexpectedly/, () => say('refusal.crashed')],
  [/^The simulation reached its time limit of ([\d.]+) s/, ([, seconds]) => say('refusal.timeLimit', { minutes: Math.round(seconds / 60) })],
  [/^The simulation (?:used more than|started more than|filled its folder)/, ({ input }) => say('refusal.overrun', { why: input })],
  [/^The operator has ended this simulation/, () => say('refusal.endedByOperator')],
  [/^This simulation has ended\. Please/, () => say('refusal.ended')],
  [/^(?:No simulation was asked for in time|Too many connections wait here|The ticket for this simulation)/, () => say('refusal.again')],
  [/^The time of this simulation can't be extended/, () => say('refusal.notExtended')],
  [/^The project is still being fetched: there is no controller/, () => say('refusal.stillFetching')],
  [/^The project has no file (.+)\.$/, ([, file]) => say('refusal.noFile', { file })]
];

// `text` without the word "Error:".
export function explain(text) {
  const told = text.trim();
  for (const [pattern, words] of TABLE) {
    const match = pattern.exec(told);
    if (match !== null)
      return words(match);
  }
  return sentence(told);
}

// Whether no machine takes a session, or the chosen one no longer does: the session server will tell when there is one.
export const isFull = (text) => [TABLE[0], TABLE[2]].some(([pattern]) => pattern.test(text.trim()));

// Whether it has none, or was asked too often: then it is worth asking again later.
export const isBusy = (text) => isFull(text) || TABLE[1][0].test(text.trim());

// With a capital letter, unless the first word is a file name or an address.
const sentence = (text) => text.replace(/^[a-z]+(?= |$)/, (word) => word[0].toUpperCase() + word.slice(1));
