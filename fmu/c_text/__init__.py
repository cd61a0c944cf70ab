"""Operations on C text."""
