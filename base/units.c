/* units.c - udunits2 behind two questions: how many SI units is this, and what kind of quantity is it. */
#include "units.h"
#include <math.h>
#include <string.h>
#include <udunits2.h>

#define UNITS_TEXT 40 /* longer is not a unit anybody writes */

/* Kinds of quantity a message can name, each with its SI unit and a value as people write it. */
static const struct {
  const char *unit, *word, *example;
} kinds[] = {
  {"-",        "a plain number",                        "0.2"       },
  {"m",        "a length",                              "150 mm"    },
  {"s",        "a time",                                "20 ms"     },
  {"kg",       "a mass",                                "2 kg"      },
  {"Pa",       "a pressure",                            "28 GPa"    },
  {"kg/m3",    "a density",                             "2400 kg/m3"},
  {"m/s",      "a velocity",                            "0.2 m/s"   },
  {"m/s2",     "an acceleration",                       "9.81 m/s2" },
  {"J/m2",     "an energy per area",                    "143 J/m2"  },
  {"elements", "a number of elements",                  "2 elements"},
  {"rad",      "an angle",                              "26.6 deg"  },
  {"m2",       "an area",                               "2 cm2"     },
  {"m3",       "a volume",                              "1 dm3"     },
  {"N",        "a force",                               "5 kN"      },
  {"J",        "an energy",                             "3 J"       },
  {"kg m2",    "a moment of inertia",                   "0.1 kg m2" },
  {"W",        "a power",                               "1 W"       },
  {"1/s",      "a rate",                                "10 1/s"    },
  {"rad/s",    "an angular velocity",                   "2 rad/s"   },
  {"kg m/s",   "a momentum",                            "1 kg m/s"  },
  {"N/m",      "a stiffness",                           "10 MN/m"   },
  {"N/m3",     "a force per volume",                    "10 kN/m3"  },
  {"K",        "a temperature",                         "293 K"     },
  {"A",        "an electric current",                   "1 A"       },
  {"A s",      "an electric charge",                    "1 A s"     }
};

/* udunits' own converters cost a parse each; scenes use few pairs, so the linear part is kept. */
typedef struct {
  char        from[UNITS_TEXT + 1], to[UNITS_TEXT + 1];
  UnitsResult result;
  PetscReal   scale, inverse, offset; /* to = from * scale + offset; inverse != 0: divide by it instead */
} Pair;

static ut_system *units;
static Pair       pairs[64];
static PetscInt   n_pairs;

static PetscErrorCode UnitsFree(void)
{
  PetscFunctionBegin;
  ut_free_system(units);
  units   = NULL;
  n_pairs = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode UnitsLoad(void)
{
  ut_unit *degree, *element;

  PetscFunctionBegin;
  if (units) PetscFunctionReturn(PETSC_SUCCESS);
  ut_set_error_message_handler(ut_ignore);
  units = ut_read_xml(NULL);
  PetscCheck(units, PETSC_COMM_SELF, PETSC_ERR_LIB, "udunits2 cannot read its unit database; install libudunits2-data, or set UDUNITS2_XML_PATH");
  degree = ut_get_unit_by_name(units, "degree");
  PetscCheck(degree && ut_map_name_to_unit("deg", UT_ASCII, degree) == UT_SUCCESS, PETSC_COMM_SELF, PETSC_ERR_LIB, "udunits2 does not know the degree");
  ut_free(degree);
  element = ut_new_base_unit(units);
  PetscCheck(element && ut_map_name_to_unit("element", UT_ASCII, element) == UT_SUCCESS && ut_map_name_to_unit("elements", UT_ASCII, element) == UT_SUCCESS && ut_map_unit_to_symbol(element, "elements", UT_ASCII) == UT_SUCCESS,
             PETSC_COMM_SELF, PETSC_ERR_LIB, "udunits2 takes no new unit");
  ut_free(element);
  PetscCall(PetscRegisterFinalize(UnitsFree));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Only plain products of names: udunits also reads "2 m", "s since 2000-01-01" and "lg(re 1 mW)", none of which is a unit here. */
static PetscBool LooksLikeUnit(const char *text)
{
  static const char *const words[] = {"since", "after", "from", "ref", "lg", "ln", "lb", "per"};
  const size_t             n       = strlen(text);
  PetscInt                 open    = 0; /* udunits reads "m)" as m */

  if (n == 0 || n > UNITS_TEXT) return PETSC_FALSE;
  for (size_t k = 0; k < sizeof(words) / sizeof(words[0]); k++) {
    const char  *at     = strstr(text, words[k]);
    const size_t length = strlen(words[k]);

    if (at && (at == text || at[-1] == ' ') && (!at[length] || strchr(" (", at[length]))) return PETSC_FALSE;
  }
  for (size_t k = 0; k < n; k++) {
    const unsigned char c = (unsigned char)text[k], before = k ? (unsigned char)text[k - 1] : ' ';
    const PetscBool     letter = (PetscBool)((before >= 'a' && before <= 'z') || (before >= 'A' && before <= 'Z') || before >= 0x80);
    const PetscBool     digit  = (PetscBool)(before >= '0' && before <= '9');

    open += (c == '(') - (c == ')');
    if (open < 0) return PETSC_FALSE;
    if ((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || strchr("%/*.^() ", c)) continue;
    if (!strncmp(text + k, "µ", 2) || !strncmp(text + k, "μ", 2) || !strncmp(text + k, "°", 2) || !strncmp(text + k, "²", 2) || !strncmp(text + k, "³", 2) || !strncmp(text + k, "·", 2)) {
      k++; /* two bytes each */
      continue;
    }
    if (c == '1' && k == 0 && text[1] == '/') continue; /* "1/s" */
    if (c == '-' && (letter || before == '^')) continue;
    if (c >= '0' && c <= '9' && (letter || digit || strchr("-^)", before))) continue;
    return PETSC_FALSE;
  }
  return (PetscBool)!open;
}

/* "-" and "" are the plain number. NULL when it is not a unit. Caller frees. */
static ut_unit *ParseUnit(const char *text)
{
  char     trimmed[UNITS_TEXT + 1];
  ut_unit *unit;

  if (!text[0] || !strcmp(text, "-")) return ut_clone(ut_get_dimensionless_unit_one(units));
  if (!LooksLikeUnit(text)) return NULL;
  strcpy(trimmed, text);
  unit = ut_parse(units, ut_trim(trimmed, UT_UTF8), UT_UTF8);
  return unit;
}

/* Same dimension, the angle counted as one. */
static PetscBool SameDimension(const ut_unit *a, const ut_unit *b)
{
  char as[256], bs[256];

  if (!ut_are_convertible(a, b)) return PETSC_FALSE;
  if (ut_format(a, as, sizeof(as), UT_DEFINITION | UT_ASCII) < 0 || ut_format(b, bs, sizeof(bs), UT_DEFINITION | UT_ASCII) < 0) return PETSC_FALSE;
  as[sizeof(as) - 1] = bs[sizeof(bs) - 1] = 0;
  return (PetscBool)(!strstr(as, "rad") == !strstr(bs, "rad"));
}

static PetscErrorCode MakePair(const char *from, const char *to, Pair *pair)
{
  ut_unit      *a, *b;
  cv_converter *converter = NULL;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(pair, 1));
  strcpy(pair->from, from);
  strcpy(pair->to, to);
  PetscCall(UnitsLoad());
  b = ParseUnit(to);
  PetscCheck(b, PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG, "'%s' is not a unit", to);
  a            = ParseUnit(from);
  pair->result = !a ? UNITS_UNKNOWN : !SameDimension(a, b) ? UNITS_DIMENSION : UNITS_OK;
  if (pair->result == UNITS_OK) {
    converter = ut_get_converter(a, b);
    if (!converter) pair->result = UNITS_DIMENSION;
  }
  if (converter) {
    pair->offset = cv_convert_double(converter, 0);
    pair->scale  = cv_convert_double(converter, 1) - pair->offset;
    if (pair->scale >= 1 && fabs(pair->scale - round(pair->scale)) < 1e-14 * pair->scale) pair->scale = round(pair->scale);
    if (pair->scale > 0 && pair->scale < 1) {
      const PetscReal inverse = round(1 / pair->scale);

      if (fabs(inverse * pair->scale - 1) < 1e-14) pair->inverse = inverse;
    }
    cv_free(converter);
  }
  ut_free(a);
  ut_free(b);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode UnitsConvert(const char *from, const char *to, PetscReal value, PetscReal *result, UnitsResult *why)
{
  const Pair *pair = NULL;
  Pair        fresh;

  PetscFunctionBegin;
  if (!from[0]) from = "-";
  if (!to[0]) to = "-";
  *why = UNITS_OK;
  if (!strcmp(from, to)) {
    *result = value;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (strlen(from) > UNITS_TEXT) {
    *why = UNITS_UNKNOWN;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCheck(strlen(to) <= UNITS_TEXT, PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG, "'%s' is not a unit", to);
  for (PetscInt k = 0; k < n_pairs && !pair; k++)
    if (!strcmp(pairs[k].from, from) && !strcmp(pairs[k].to, to)) pair = &pairs[k];
  if (!pair) {
    PetscCall(MakePair(from, to, &fresh));
    pair = &fresh;
    if (n_pairs < (PetscInt)(sizeof(pairs) / sizeof(pairs[0]))) pairs[n_pairs++] = fresh;
  }
  *why = pair->result;
  if (pair->result == UNITS_OK) *result = (pair->inverse > 0 ? value / pair->inverse : value * pair->scale) + pair->offset;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscInt KindOf(const char *unit)
{
  for (PetscInt k = 0; k < (PetscInt)(sizeof(kinds) / sizeof(kinds[0])); k++) {
    PetscReal   ignored;
    UnitsResult result;

    if (!UnitsConvert(unit, kinds[k].unit, 1, &ignored, &result) && result == UNITS_OK) return k;
  }
  return -1;
}

const char *UnitsWord(const char *unit)
{
  const PetscInt k = KindOf(unit);

  return k < 0 ? "of another kind" : kinds[k].word;
}

const char *UnitsExample(const char *unit)
{
  const PetscInt k = KindOf(unit);

  return k < 0 ? unit : kinds[k].example;
}
