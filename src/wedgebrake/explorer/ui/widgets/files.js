// A message above the server's limit would end the connection. Of a file that is too large the page
// sends one byte more than is allowed, so that it is refused in words. The event precedes the one at
// which Bokeh reads the file.
addEventListener("input", (event) => {
  const chosen = event.composedPath()[0];
  if (chosen.type !== "file") return;
  const sent = new DataTransfer();
  for (const file of chosen.files) {
    sent.items.add(new File([file.slice(0, MOST + 1)], file.name, {type: file.type}));
  }
  chosen.files = sent.files;
}, true);
