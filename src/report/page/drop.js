// Sends a program that is dropped or chosen, and goes to its page.
const place = document.getElementById('drop');
const said = document.getElementById('said');

async function send(file) {
  if (!file) return;
  if (file.size > Number(place.dataset.most)) {
    said.textContent = `${file.name} is too large: put it into the folder`;
    return;
  }
  said.textContent = `reads ${file.name} …`;
  const answer = await fetch(`drop/${encodeURIComponent(file.name)}`, { method: 'POST', body: file });
  const text = await answer.text();
  if (answer.ok) location.assign(text);
  else said.textContent = text;
}

document.getElementById('choose').addEventListener('change', (event) => send(event.target.files[0]));
addEventListener('dragover', (event) => event.preventDefault());
addEventListener('drop', (event) => {
  event.preventDefault();
  send(event.dataTransfer.files[0]);
});
