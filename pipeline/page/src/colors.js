// Colors that people with any color vision can tell apart, also in gray.
import {interpolateViridis} from "d3-scale-chromatic";

/** Force as a color of viridis; its dark end is left out, so that it shows on dark and on light. */
export const forceColor = (part) => interpolateViridis(0.25 + 0.75 * Math.min(1, Math.max(0, part)));

/** The same as [r, g, b] in [0, 1]. */
export const forceRgb = (part) => {
  const hex = parseInt(toHex(forceColor(part)), 16);
  return [(hex >> 16) / 255, ((hex >> 8) & 255) / 255, (hex & 255) / 255];
};

const toHex = (color) => {
  if (color.startsWith("#")) return color.slice(1);
  return color
    .match(/\d+/g)
    .map((c) => Number(c).toString(16).padStart(2, "0"))
    .join("");
};

/** Black or white, whichever is read better on the color. */
export const inkOn = (color) => {
  const hex = parseInt(toHex(color), 16);
  const linear = [hex >> 16, (hex >> 8) & 255, hex & 255].map((c) => {
    const s = c / 255;
    return s <= 0.03928 ? s / 12.92 : ((s + 0.055) / 1.055) ** 2.4;
  });
  const luminance = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
  return luminance > 0.179 ? "#000000" : "#ffffff";
};

/** Lines of charts, after Okabe and Ito, dark enough for white paper. */
export const lineColors = ["#0072b2", "#b34a00", "#00785a", "#7a3b78", "#5b5b5b"];

/** A bar of the force scale with its ends in newtons. */
export const gradient = () => {
  const stops = Array.from({length: 9}, (_, k) => forceColor(k / 8));
  return `linear-gradient(to right, ${stops.join(", ")})`;
};
