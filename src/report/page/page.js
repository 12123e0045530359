"use strict";
// One scrubber a scene: pictures and figures of the frame, by mouse, touch or keyboard.
for (const section of document.querySelectorAll("section.scene")) {
  const data = JSON.parse(section.querySelector("script.data").textContent);
  const slider = section.querySelector("input[type=range]");
  const said = section.querySelector("output");
  const rows = [...section.querySelectorAll("tr[data-lane]")];
  const pictures = [...section.querySelectorAll("img[data-layer]")];
  const show = () => {
    const shot = Number(slider.value);
    const { frame, view } = data.shots[shot];
    said.textContent = "frame " + frame + (data.views > 1 ? ", view " + view : "");
    slider.setAttribute("aria-valuetext", said.textContent);
    for (const row of rows) {
      const figures = data.lanes[Number(row.dataset.lane)].frames[shot] ?? []; // a lane that ended early has none
      [...row.querySelectorAll("td[data-figure]")].forEach((cell, i) => { cell.textContent = figures[i] ?? ""; });
    }
    for (const image of pictures) {
      const png = data.pictures[shot] && data.pictures[shot][image.dataset.layer];
      image.hidden = !png;
      if (png) image.src = "data:image/png;base64," + png;
    }
  };
  const step = (by) => {
    slider.value = String(Math.min(Math.max(Number(slider.value) + by, 0), Number(slider.max)));
    show();
  };
  slider.addEventListener("input", show);
  section.querySelector("button.back").addEventListener("click", () => step(-1));
  section.querySelector("button.on").addEventListener("click", () => step(1));
  // A link may name a frame: #city@7.
  const open = () => {
    const [name, frame] = decodeURIComponent(location.hash.slice(1)).split("@");
    if (name !== section.id || !frame) return;
    const shot = data.shots.findIndex((shot) => shot.frame === Number(frame));
    if (shot < 0) return;
    slider.value = String(shot);
    show();
    section.scrollIntoView();
  };
  window.addEventListener("hashchange", open);
  show();
  open();
}
// The arrows move the scrubber of the scene on the screen, wherever the focus is.
document.addEventListener("keydown", (event) => {
  if (event.target instanceof HTMLInputElement || !["ArrowLeft", "ArrowRight"].includes(event.key)) return;
  const middle = window.innerHeight / 2;
  for (const section of document.querySelectorAll("section.scene")) {
    const box = section.getBoundingClientRect();
    if (box.top <= middle && box.bottom >= middle) {
      section.querySelector(event.key === "ArrowLeft" ? "button.back" : "button.on").click();
      event.preventDefault();
    }
  }
});
