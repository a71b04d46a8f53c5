// Lays the picture after the repair upon that before it, and cuts it where the slider stands.
"use strict";
(() => {
  const compare = document.getElementById("compare");
  const slider = document.getElementById("slider");
  if (!compare || !slider) return;
  document.documentElement.classList.add("scripted");
  const cut = () => compare.style.setProperty("--cut", slider.value + "%");
  const follow = (event) => {
    const box = compare.getBoundingClientRect();
    slider.value = (100 * (event.clientX - box.left)) / box.width;
    cut();
  };
  slider.addEventListener("input", cut);
  compare.addEventListener("pointerdown", (event) => {
    event.preventDefault();
    compare.setPointerCapture(event.pointerId);
    follow(event);
  });
  compare.addEventListener("pointermove", (event) => {
    if (compare.hasPointerCapture(event.pointerId)) follow(event);
  });
  cut();
})();
