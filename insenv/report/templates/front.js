"use strict";
// The front of a design: a point that is pointed at shows its profile, a point that is pressed its scenario file.
{
  const section = document.getElementById("explore"), marks = Array.from(section.querySelectorAll(".mark"));
  const status = document.getElementById("copied");
  let kept = Math.max(0, marks.findIndex(mark => mark.classList.contains("designed")));
  section.hidden = false;
  const show = k => {
    for (const one of section.querySelectorAll("[data-point]")) one.toggleAttribute("hidden", Number(one.dataset.point) !== k);
    marks.forEach((mark, j) => mark.classList.toggle("shown", j === k));
  };
  const keep = k => {
    kept = k;
    marks.forEach((mark, j) => mark.setAttribute("aria-pressed", String(j === k)));
    document.getElementById("scenario").value = document.getElementById(`scenario-${k}`).textContent;
    status.textContent = "";
    show(k);
  };
  marks.forEach((mark, k) => {
    mark.addEventListener("pointerenter", () => show(k));
    mark.addEventListener("focus", () => show(k));
    mark.addEventListener("click", () => keep(k));
    mark.addEventListener("keydown", event => {
      const to = {ArrowRight: k + 1, ArrowLeft: k - 1}[event.key];
      if (marks[to]) marks[to].focus();
      if (event.key === "Enter" || event.key === " ") { keep(k); event.preventDefault(); }
    });
  });
  document.getElementById("front-picture").addEventListener("pointerleave", () => show(kept));
  document.getElementById("copy").addEventListener("click", async () => {
    const box = document.getElementById("scenario");
    box.select();
    try { await navigator.clipboard.writeText(box.value); } catch { document.execCommand("copy"); }
    status.textContent = "Copied. Save it as a .toml file and play it: insenv evaluate --scenario FILE.toml, insenv play --scenario FILE.toml.";
  });
  keep(kept);
}
