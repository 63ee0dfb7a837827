"""Speed against error: each method of wentry against its peers, on truths that the methods do not see."""
