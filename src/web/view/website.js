// Projects of websites: the message that starts one, and the files of its controllers. No DOM.

// The text that starts the project of `target` (protocol section 5.1). `origin` is the page's, `user` has the members
// User1Id, User1Name, User1Authentication, User2Id, User2Name and CustomData, all of which may be missing.
export function initMessage(target, origin, user, mode) {
  const elements = [origin.replace('://www.', '://'), target.project, target.file,
    identity(user.User1Id), user.User1Name, user.User1Authentication, identity(user.User2Id), user.User2Name, user.CustomData];
  const list = elements.map((element) => quoted(String(element ?? ''))).join(', ');
  return `{ "init" : [ ${list} ]${mode === 'mjpeg' ? ', "mode" : "mjpeg"' : ''}, "reasons" : true }`;
}

// 0 is documented as nobody, for whom servers expect nothing.
const identity = (id) => (id === 0 ? '' : id);

// Pages were told to send what is between the quotes of a JSON string, which most values are as they stand. Others are escaped.
function quoted(text) {
  const asItStands = `"${text}"`;
  try {
    return typeof JSON.parse(asItStands) === 'string' ? asItStands : JSON.stringify(text);
  } catch {
    return JSON.stringify(text);
  }
}

// A message with a file of a controller, which the simulator sends, and takes: {controller, file, content}.
export const fileMessage = ({ controller, file, content }) =>
  `set controller:${controller}/${file}:${content.split('\n').length}\n${content}`;

// Returns null for any other message.
export function parseFileMessage(message) {
  const [, controller, file, content] = /^set controller: ?([^/\n]+)\/([^\n]+):\d+\n([^]*)$/.exec(message) ?? [];
  return controller === undefined ? null : { controller, file, content };
}

// Stores a file in the user's copy of the project, at the page's own website (protocol section 5.4). Rejects with an Error
// whose message can be shown.
export async function upload(dirname, filename, content) {
  const form = new FormData();
  form.append('dirname', dirname);
  form.append('filename', filename);
  form.append('content', content);
  const response = await fetch('/ajax/upload-file.php', { method: 'POST', body: form });
  const answer = (await response.text()).trim();
  if (answer !== 'OK')
    throw new Error(plain(answer.replace(/^Error:\s*/, '')) || `HTTP ${response.status}`);
}

// Websites answer with line breaks for browsers.
const plain = (html) => html.replace(/<br\s*\/?>/gi, ' ').replace(/<[^>]*>/g, '');
