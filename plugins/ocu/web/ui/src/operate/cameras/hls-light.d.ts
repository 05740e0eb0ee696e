// hls.js describes its whole build alone; the light one leaves out subtitles and encryption.
declare module "hls.js/light" {
  export { default } from "hls.js";
}
