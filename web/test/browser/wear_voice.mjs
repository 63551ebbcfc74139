// The expert hears the phone. (The expert's browser here has no microphone.)
const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/** Chromium's fake microphone beeps once a second. */
export async function voice({ check, phone, expert }) {
  const played = async (page, selector) => {
    const text = (await page.locator(selector).getAttribute('data-heard')) ?? '';
    return Number(text.split(' ')[0] || 0);
  };
  await phone.page.locator('.voice').click();
  await expert.press('8');
  const ways = [['expert', expert.page, '.voice']];
  for (const [who, page, selector] of ways) {
    let frames = 0;
    for (const end = Date.now() + 20_000; frames < 25 && Date.now() < end; await sleep(200)) {
      frames = await played(page, selector);
    }
    check(`the ${who} hears the phone`, frames >= 25, `${frames} frames of 20 ms`);
  }
  await phone.page.locator('.voice').click();
  await expert.press('8');
}
