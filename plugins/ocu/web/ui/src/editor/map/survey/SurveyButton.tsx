// Opens the survey of an area, or the one that a route is a part of.
import type { Geometry } from "../../../shared/types";
import { strings } from "../../../strings";
import { readPattern } from "./pattern";
import type { Surveys } from "./surveys";

const words = strings.survey;

export function SurveyButton({ surveys, geometry }: { surveys: Surveys; geometry: Geometry }) {
  const { kind, name, survey } = geometry;
  if (kind === "area")
    return (
      <button type="button" class="secondary" onClick={() => surveys.begin(name)}>
        {words.begin}
      </button>
    );
  if (!survey || !readPattern(survey.pattern)) return null;
  return (
    <button type="button" class="secondary" onClick={() => surveys.change(geometry)}>
      {words.change}
    </button>
  );
}
