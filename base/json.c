/* json.c - RFC 8259 text, two blanks per level. */
#include "json.h"
#include "files.h"
#include <stdlib.h>
#include <string.h>

static void Quote(FILE *out, const char *text)
{
  fputc('"', out);
  for (const unsigned char *c = (const unsigned char *)text; *c; c++) {
    if (*c == '"' || *c == '\\') fprintf(out, "\\%c", *c);
    else if (*c == '\n') fputs("\\n", out);
    else if (*c == '\t') fputs("\\t", out);
    else if (*c < 0x20 || *c == 0x7f) fprintf(out, "\\u%04x", *c);
    else fputc(*c, out);
  }
  fputc('"', out);
}

/* Comma, line, key: what stands before every value. */
static PetscErrorCode Lead(Json *json, const char *key)
{
  PetscFunctionBegin;
  PetscCheck(json->out, PETSC_COMM_SELF, PETSC_ERR_ORDER, "The JSON file is not open");
  PetscCheck((key != NULL) == (json->closer[json->depth] == '}'), PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG, "JSON: a key belongs in an object, and only there");
  fprintf(json->out, "%s\n%*s", json->used[json->depth] ? "," : "", (int)(2 * (json->depth + 1)), "");
  json->used[json->depth] = PETSC_TRUE;
  if (key) {
    Quote(json->out, key);
    fputs(": ", json->out);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Begin(Json *json, const char *key, char opener, char closer)
{
  PetscFunctionBegin;
  PetscCall(Lead(json, key));
  PetscCheck(json->depth + 1 < JSON_DEPTH, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE, "JSON deeper than %d levels", JSON_DEPTH);
  fputc(opener, json->out);
  json->depth++;
  json->closer[json->depth] = closer;
  json->used[json->depth]   = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode JsonOpen(const char *path, Json *json)
{
  char part[BASE_LINE];

  PetscFunctionBegin;
  memset(json, 0, sizeof(*json));
  PetscCall(BaseFormat(json->path, "%s", path));
  PetscCall(BaseFormat(part, "%s.part", path));
  PetscCall(FileOpen(part, "w", &json->out));
  json->closer[0] = '}';
  fputc('{', json->out);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode JsonClose(Json *json)
{
  char part[BASE_LINE];

  PetscFunctionBegin;
  PetscCall(BaseFormat(part, "%s.part", json->path));
  while (json->depth > 0) PetscCall(JsonEnd(json));
  fputs("\n}\n", json->out);
  PetscCall(FileClose(&json->out, part));
  PetscCall(FileCommit(part, json->path, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode JsonBeginObject(Json *json, const char *key)
{
  return Begin(json, key, '{', '}');
}

PetscErrorCode JsonBeginArray(Json *json, const char *key)
{
  return Begin(json, key, '[', ']');
}

PetscErrorCode JsonEnd(Json *json)
{
  PetscFunctionBegin;
  PetscCheck(json->depth > 0, PETSC_COMM_SELF, PETSC_ERR_ORDER, "JSON: nothing is open to end");
  if (json->used[json->depth]) fprintf(json->out, "\n%*s", (int)(2 * json->depth), "");
  fputc(json->closer[json->depth--], json->out);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode JsonReal(Json *json, const char *key, PetscReal value)
{
  char text[64] = "null";

  PetscFunctionBegin;
  PetscCall(Lead(json, key));
  if (!PetscIsInfOrNanReal(value))
    for (int digits = 12; digits <= 17; digits++) {
      snprintf(text, sizeof(text), "%.*g", digits, (double)value);
      if (strtod(text, NULL) == (double)value) break;
    }
  fputs(text, json->out);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode JsonInt(Json *json, const char *key, PetscInt64 value)
{
  PetscFunctionBegin;
  PetscCall(Lead(json, key));
  fprintf(json->out, "%lld", (long long)value);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode JsonBool(Json *json, const char *key, PetscBool value)
{
  PetscFunctionBegin;
  PetscCall(Lead(json, key));
  fputs(value ? "true" : "false", json->out);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode JsonString(Json *json, const char *key, const char *value)
{
  PetscFunctionBegin;
  PetscCall(Lead(json, key));
  if (value) Quote(json->out, value);
  else fputs("null", json->out);
  PetscFunctionReturn(PETSC_SUCCESS);
}
