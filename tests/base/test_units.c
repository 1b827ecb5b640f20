/* test_units.c - numbers with units: factors known by heart, wrong dimensions, texts that are no unit. */
#include "check.h"
#include "units.h"

static PetscErrorCode TestFactors(void)
{
  static const struct {
    const char *from, *to;
    PetscReal   value, want;
  } cases[] = {
    {"GPa",   "Pa",       28,     28e9        },
    {"mm",    "m",        150,    0.15        },
    {"mm",    "m",        1.1,    0.0011      },
    {"us",    "s",        20,     2e-5        },
    {"µs",    "s",        20,     2e-5        },
    {"ms",    "s",        0.1,    1e-4        },
    {"min",   "s",        2,      120         },
    {"N/mm2", "Pa",       3,      3e6         },
    {"N/m",   "J/m2",     143,    143         },
    {"g/cm3", "kg/m3",    2.5,    2500        },
    {"t/m3",  "kg/m3",    2.5,    2500        },
    {"in",    "m",        1,      0.0254      },
    {"km/h",  "m/s",      36,     10          },
    {"%",     "-",        20,     0.2         },
    {"m s-2", "m/s2",     9.81,   9.81        },
    {"m/s/s", "m/s2",     9.81,   9.81        },
    {"m/s²",  "m/s2",     9.81,   9.81        },
    {"N·m",   "J",        2,      2           },
    {"m/s^2", "m/s2",     9.81,   9.81        },
    {"deg",   "rad",      180,    PETSC_PI    },
    {"psi",   "Pa",       1,      6894.757293 },
    {"element", "elements", 2,    2           }
  };

  PetscFunctionBeginUser;
  for (size_t k = 0; k < sizeof(cases) / sizeof(cases[0]); k++)
    for (int again = 0; again < 2; again++) { /* the second time from the cache */
      PetscReal   got;
      UnitsResult why;

      PetscCall(UnitsConvert(cases[k].from, cases[k].to, cases[k].value, &got, &why));
      CheckInt(why, UNITS_OK);
      CheckClose(got, cases[k].want, 1e-9);
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestFactors)

/* Powers of ten come out as the double nearest to the decimal a user wrote. */
static PetscErrorCode TestDecimalsAreExact(void)
{
  PetscFunctionBeginUser;
  for (int k = 1; k < 2000; k++) {
    char        text[32];
    PetscReal   got;
    UnitsResult why;

    PetscCall(UnitsConvert("mm", "m", k / 10.0, &got, &why));
    snprintf(text, sizeof(text), "%.1fe-3", k / 10.0);
    if (got != strtod(text, NULL)) {
      const double ulp = nextafter(got, 1) - got; /* k/10 is itself rounded, so the last bit may differ */

      CheckNear(got, strtod(text, NULL), ulp);
    }
    PetscCall(UnitsConvert("mm", "m", k, &got, &why));
    snprintf(text, sizeof(text), "%de-3", k);
    CheckNear(got, strtod(text, NULL), 0);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestDecimalsAreExact)

static PetscErrorCode TestWrongDimension(void)
{
  static const char *const wrong[][2] = {
    {"GPa", "kg/m3"   },
    {"m",   "-"       },
    {"deg", "-"       }, /* not the friction coefficient it looks like */
    {"-",   "rad"     },
    {"m",   "elements"},
    {"rad/s", "1/s"   },
    {"s",   "m"       },
    {"K",   "m"       }
  };

  PetscFunctionBeginUser;
  for (size_t k = 0; k < sizeof(wrong) / sizeof(wrong[0]); k++) {
    PetscReal   got;
    UnitsResult why;

    PetscCall(UnitsConvert(wrong[k][0], wrong[k][1], 1, &got, &why));
    CheckInt(why, UNITS_DIMENSION);
  }
  CheckContains(UnitsWord("GPa"), "a pressure");
  CheckContains(UnitsWord("mm/us"), "a velocity");
  CheckContains(UnitsWord("deg"), "an angle");
  CheckContains(UnitsWord("kN"), "a force");
  CheckContains(UnitsWord("mol"), "of another kind");
  CheckContains(UnitsExample("kg/m3"), "kg/m3");
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestWrongDimension)

static PetscErrorCode TestNoUnit(void)
{
  static const char *const no[] = {"GPx", "o mm", "2 m", "s since 2000-01-01", "lg(re 1 mW)", "m 3", "m @ 3", "-m", "((((((((((m", "m)", "/", "^", "m^", "m//s", "mm\n", ".", "a very long text that is surely not a unit of anything", "\xff"};

  PetscFunctionBeginUser;
  for (size_t k = 0; k < sizeof(no) / sizeof(no[0]); k++) {
    PetscReal   got;
    UnitsResult why;

    PetscCall(UnitsConvert(no[k], "m", 1, &got, &why));
    if (why != UNITS_UNKNOWN) fail_msg("'%s' passed as a unit", no[k]);
  }
  CheckFails(UnitsConvert("m", "bogus", 1, &(PetscReal){0}, &(UnitsResult){0}), PETSC_ERR_ARG_WRONG, "'bogus' is not a unit");
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestNoUnit)

static const struct CMUnitTest tests[] = {TEST(TestFactors), TEST(TestDecimalsAreExact), TEST(TestWrongDimension), TEST(TestNoUnit)};

CHECK_MAIN(tests)
