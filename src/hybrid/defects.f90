!! What a method does to a contact otherwise than its law says, and which events that puts in doubt (razy_hybrid_cubic_doubts).
!!
!! The defect of the forces, as an acceleration d of s, changes s' by up to the drift ∫|d| dt and s by ∫ drift dt since the last
!! passage of a bound. A bound that is passed with the rate s' is passed earlier or later by the share drift/|s'| of the interval
!! since the passage before. Where force and defect depend on s alone, what the defect takes on the way in it gives back on the way
!! out; where they do not, as in time stepping, what one passage loses is lost for all that follow, whose shifts have it again.
!! When the shifts add up to a whole interval, there may be one event more or less: from then on every passage is in doubt.
module razy_hybrid_defects
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: defects_t

   !> Of each contact (contacts).
   type :: defects_t
      !> ∫|d| dt and its integral since the last passage, in the units of s' and of s.
      real(wp), allocatable :: drift(:), way(:)
      !> Shares that stay, and shift of the passages so far in units of the interval between two.
      real(wp), allocatable :: loss(:), shift(:)
   contains
      procedure :: begin => begin_defects
      procedure :: gather
      procedure :: pass
   end type defects_t

contains

   !> None yet, of so many contacts.
   pure subroutine begin_defects(self, contacts)
      class(defects_t), intent(inout) :: self
      integer, intent(in) :: contacts

      if (allocated(self%drift)) deallocate (self%drift, self%way, self%loss, self%shift)
      allocate (self%drift(contacts), self%way(contacts), self%loss(contacts), self%shift(contacts), source=0.0_wp)
   end subroutine begin_defects

   !> In a step h, s, the mean of |d| was `defect` (contacts).
   pure subroutine gather(self, h, defect)
      class(defects_t), intent(inout) :: self
      real(wp), intent(in) :: h, defect(:)

      self%way = self%way + h*(self%drift + 0.5_wp*h*defect)
      self%drift = self%drift + h*defect
   end subroutine gather

   !> Contact j has passed a bound with `rate`; `lasting`: what the defect took from the motion is not given back.
   pure subroutine pass(self, j, rate, lasting, doubtful)
      class(defects_t), intent(inout) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: rate
      logical, intent(in) :: lasting
      logical, intent(out) :: doubtful

      real(wp) :: share

      share = 1.0_wp
      if (self%drift(j) < abs(rate)) share = self%drift(j)/abs(rate)
      if (.not. self%drift(j) > 0.0_wp) share = 0.0_wp
      if (lasting) then
         self%loss(j) = self%loss(j) + share
         share = self%loss(j)
      end if
      self%shift(j) = self%shift(j) + share
      self%drift(j) = 0.0_wp
      self%way(j) = 0.0_wp
      doubtful = self%shift(j) >= 1.0_wp
   end subroutine pass

end module razy_hybrid_defects
