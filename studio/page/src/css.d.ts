// Style sheets, which the bundler gathers in studio.css.
declare module '*.css';
