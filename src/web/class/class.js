// The page of a class: two doors, or the one that the address names. The part that is shown is kept on <body>, in data-shown:
//   doors  name  seat (a student's simulation)  open (the teacher's form)  lesson  look (one simulation, large)  over

import { loadPageTexts, offerLanguages } from './view/page_texts.js';
import { Student } from './student.js';
import { Teacher } from './teacher.js';
import { codeOf, element, show } from './page.js';

await loadPageTexts();

const code = codeOf(location.pathname.split('/').pop());
const user = code === '' ? new Teacher() : new Student(code);
offerLanguages(element('language'), () => user.sayAll());

// Without a code, this is the page of the teacher, who may have a class already, or of somebody who types the code in.
const choose = () => (location.hash === '#teach' ? user.ask() : show('doors'));

element('code-form').addEventListener('submit', (event) => {
  event.preventDefault();
  const typed = codeOf(element('code').value);
  if (typed !== '')
    location.assign(`./${encodeURIComponent(typed)}`);
});

user.sayAll();
if (!await user.comeBack()) {
  if (code !== '')
    user.ask();
  else {
    addEventListener('hashchange', () => user.idle && choose());
    choose();
  }
}
