// Numbers for people, and the words over the map.

const COMPASS = ["N", "NE", "E", "SE", "S", "SW", "W", "NW"];
const notices = document.querySelector("#notices");

// A line that goes by itself; the same words are not shown twice at a time.
export function notice(text, isGood = false) {
  if ([...notices.children].some((line) => line.textContent === text)) return;
  const line = document.createElement("p");
  line.textContent = text;
  line.className = isGood ? "good" : "bad";
  line.addEventListener("click", () => line.remove());
  notices.append(line);
  setTimeout(() => line.remove(), isGood ? 4000 : 12000);
}

// A direction [degrees, counter-clockwise from true east] as a compass has it.
export function compass(direction) {
  const bearing = (((90 - direction) % 360) + 360) % 360;
  return `${Math.round(bearing) % 360}° ${COMPASS[Math.round(bearing / 45) % 8]}`;
}

// A number with a sign that is as wide as the other one.
export const signed = (value, digits = 2) => (value > 0 ? "+" : value < 0 ? "−" : "") + Math.abs(value).toFixed(digits);
