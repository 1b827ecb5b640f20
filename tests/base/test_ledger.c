/* test_ledger.c - the balance and its error by hand; the JSON writer, which has no physics to test either. */
#include "check.h"
#include "json.h"
#include "files.h"
#include "ledger.h"

/* 3 J kinetic, 2 J strain, 1 J broken, from 1 J at the start and 5 J of work: nothing is missing. */
static PetscErrorCode TestBalanceByHand(void)
{
  Ledger l = {.energy = {[LEDGER_KINETIC] = 3, [LEDGER_STRAIN] = 2, [LEDGER_FRACTURE] = 1, [LEDGER_WORK] = 5}, .initial = 1, .work_in = 7, .scale = 2};

  PetscFunctionBeginUser;
  CheckNear(LedgerBalance(&l), 0, 0);
  CheckNear(LedgerError(&l), 0, 0);
  l.energy[LEDGER_FRICTION] = 0.5; /* half a joule too much, of 7 + 1 put in */
  CheckNear(LedgerBalance(&l), 0.5, 0);
  CheckNear(LedgerError(&l), 0.5 / 8, 1e-16);
  l.energy[LEDGER_FRICTION] = -0.5;
  CheckNear(LedgerError(&l), 0.5 / 8, 1e-16);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestBalanceByHand)

/* Each dissipation and each store counts with the same sign, work with the other. */
static PetscErrorCode TestEveryTermCounts(void)
{
  PetscFunctionBeginUser;
  for (int term = 0; term < LEDGER_TERMS; term++) {
    Ledger l = {.work_in = 1};

    l.energy[term] = 0.25;
    CheckNear(LedgerBalance(&l), term == LEDGER_WORK ? -0.25 : 0.25, 0);
    CheckNear(LedgerError(&l), 0.25, 0);
    CheckTrue(LedgerNames[term] && LedgerNames[term][0]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestEveryTermCounts)

/* Before anything is put in, the floor of 1e-12 of the scale keeps round-off from looking like an error of order one. */
static PetscErrorCode TestFloor(void)
{
  Ledger l = {.scale = 10};

  PetscFunctionBeginUser;
  CheckNear(LedgerError(&l), 0, 0);
  l.energy[LEDGER_STRAIN] = 1e-20;
  CheckNear(LedgerError(&l), 1e-9, 1e-22);
  l.scale = 0; /* something from nothing, without a scale to forgive it */
  CheckTrue(PetscIsInfReal(LedgerError(&l)));
  l.energy[LEDGER_STRAIN] = NAN;
  CheckTrue(PetscIsNanReal(LedgerError(&l)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestFloor)

static PetscErrorCode TestSum(void)
{
  Ledger a = {.energy = {1, 2, 3, 4, 5, 6, 7, 8}, .initial = 9, .work_in = 10, .scale = 11}, b = a;

  PetscFunctionBeginUser;
  LedgerAdd(&a, &b);
  for (int term = 0; term < LEDGER_TERMS; term++) CheckNear(a.energy[term], 2 * (term + 1), 0);
  CheckNear(a.initial, 18, 0);
  CheckNear(a.work_in, 20, 0);
  CheckNear(a.scale, 22, 0);
  CheckNear(LedgerBalance(&a), 2 * LedgerBalance(&b), 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestSum)

static PetscErrorCode TestJson(void)
{
  Json  json;
  char *text;

  PetscFunctionBeginUser;
  PetscCall(JsonOpen("test_ledger.json", &json));
  PetscCall(JsonReal(&json, "tenth", 0.1));
  PetscCall(JsonReal(&json, "third", 1. / 3));
  PetscCall(JsonReal(&json, "lost", NAN));
  PetscCall(JsonString(&json, "quote", "a \"b\"\\\n\tc\x01 \xc3\xa9"));
  PetscCall(JsonBeginObject(&json, "empty"));
  PetscCall(JsonEnd(&json));
  PetscCall(JsonBeginArray(&json, "list"));
  PetscCall(JsonInt(&json, NULL, -3));
  PetscCall(JsonBool(&json, NULL, PETSC_TRUE));
  PetscCall(JsonBeginObject(&json, NULL));
  PetscCall(JsonString(&json, "none", NULL));
  CheckFails(JsonInt(&json, NULL, 1), PETSC_ERR_ARG_WRONG, "key");
  PetscCall(JsonClose(&json)); /* closes what is open */
  PetscCall(FileReadText("test_ledger.json", &text, NULL));
  CheckTrue(!strcmp(text, "{\n  \"tenth\": 0.1,\n  \"third\": 0.3333333333333333,\n  \"lost\": null,\n  \"quote\": \"a \\\"b\\\"\\\\\\n\\tc\\u0001 \xc3\xa9\",\n"
                          "  \"empty\": {},\n  \"list\": [\n    -3,\n    true,\n    {\n      \"none\": null\n    }\n  ]\n}\n"));
  PetscCall(PetscFree(text));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestJson)

static const struct CMUnitTest tests[] = {TEST(TestBalanceByHand), TEST(TestEveryTermCounts), TEST(TestFloor), TEST(TestSum), TEST(TestJson)};
CHECK_MAIN(tests)
