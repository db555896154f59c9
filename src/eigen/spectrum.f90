!! The eigenvalues and shapes of one of a family of eigenproblems, and which of them continue which of another one: by shape, not by
!! order.
!!
!! The measure is the modal assurance criterion in the metric of the later spectrum, |xᴴMy|²/((xᴴMx)(yᴴMy)). Degenerate eigenmodes,
!! whose eigenvalues differ by no more than rounding, have no shapes of their own, only a common space: they are matched by their
!! spaces, and their shapes are made of those that they continue, projected on it.
module razy_eigen_spectrum
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: continue_branches, first_of_equal, new_spectrum, spectrum_t

   !> The value of the family's parameter, eigenvalues (modes), and shapes (coordinates, modes) of unit length.
   type :: spectrum_t
      real(wp) :: parameter = 0.0_wp
      complex(wp), allocatable :: value(:), shape(:, :)
      !> M of the lengths and products of shapes; the unit matrix if not allocated.
      real(wp), allocatable :: metric(:, :)
      !> The first of the modes that are degenerate with each (modes); their shapes are orthonormal.
      integer, allocatable :: first(:)
      !> The branch that each belongs to (modes), from 1; 0 if it continues none.
      integer, allocatable :: branch(:)
      !> Of what `continue_branches` has matched, the assurance criterion of each mode with the one it continues, of degenerate
      !> ones that of their spaces (modes).
      real(wp), allocatable :: likeness(:)
   contains
      procedure :: equals_of
   end type spectrum_t

   !> What is left of a vector's length when it is taken as a combination of others.
   real(wp), parameter :: dependent = 1.0e-3_wp
   !> Weight of the overlap of single shapes where that of their spaces does not tell them apart.
   real(wp), parameter :: tie = 1.0e-9_wp

contains

   !> A spectrum with a branch for each mode. Modes next to each other in the list are degenerate as `first_of_equal` says.
   function new_spectrum(parameter, value, shape, relative, absolute, metric) result(spectrum)
      real(wp), intent(in) :: parameter, relative, absolute
      complex(wp), intent(in) :: value(:), shape(:, :)
      real(wp), intent(in), optional :: metric(:, :)
      type(spectrum_t) :: spectrum

      complex(wp), allocatable :: basis(:, :)
      integer :: i, last
      logical :: independent

      spectrum%parameter = parameter
      spectrum%value = value
      spectrum%shape = shape
      spectrum%first = first_of_equal(value, relative, absolute)
      spectrum%branch = [(i, i=1, size(value))]
      if (present(metric)) then
         ! Modes of symmetric problems are orthonormal already.
         spectrum%metric = metric
         return
      end if
      do i = 1, size(value)
         last = i + count(spectrum%first == i) - 1
         if (last <= i) cycle
         basis = shape(:, i:last)
         call orthonormalise(basis, independent)
         if (independent) spectrum%shape(:, i:last) = basis
      end do
   end function new_spectrum

   !> For each value the place of the first one that equals it, through others if need be: neighbours in the list that differ by no
   !> more than `absolute` and `relative` of their size.
   pure function first_of_equal(value, relative, absolute) result(first)
      complex(wp), intent(in) :: value(:)
      real(wp), intent(in) :: relative, absolute
      integer :: first(size(value))

      integer :: i

      first = [(i, i=1, size(value))]
      do i = 2, size(value)
         if (abs(value(i) - value(i - 1)) <= relative*abs(value(i)) + absolute) first(i) = first(i - 1)
      end do
   end function first_of_equal

   !> The places of all modes that are degenerate with mode i, itself among them.
   pure function equals_of(self, i) result(places)
      class(spectrum_t), intent(in) :: self
      integer, intent(in) :: i
      integer, allocatable :: places(:)

      integer :: k

      places = pack([(k, k=1, size(self%first))], self%first == self%first(i))
   end function equals_of

   !> Give each mode of `after` the branch of the mode of `before` that it continues: pairs of largest overlap first, each once.
   pure subroutine continue_branches(before, after)
      type(spectrum_t), intent(in) :: before
      type(spectrum_t), intent(inout) :: after

      complex(wp), allocatable :: product(:, :)
      real(wp), allocatable :: overlap(:, :), own(:, :)
      integer :: best(2), equal_after(size(after%value)), equal_before(size(before%value)), i, j, k, partner(size(after%value))

      product = products(before, after)
      own = product%re**2 + product%im**2
      overlap = own
      equal_before = [(count(before%first == i), i=1, size(before%value))]
      equal_after = [(count(after%first == j), j=1, size(after%value))]
      do j = 1, size(after%value)
         if (after%first(j) /= j) cycle
         do i = 1, size(before%value)
            if (before%first(i) /= i) cycle
            associate (m => equal_before(i), n => equal_after(j))
               overlap(i:i + m - 1, j:j + n - 1) = sum(own(i:i + m - 1, j:j + n - 1))/min(m, n)
            end associate
         end do
      end do
      own = overlap + tie*own
      partner = 0
      after%likeness = spread(0.0_wp, 1, size(partner))
      after%branch = 0
      do k = 1, min(size(before%value), size(after%value))
         best = maxloc(own)
         partner(best(2)) = best(1)
         after%branch(best(2)) = before%branch(best(1))
         after%likeness(best(2)) = overlap(best(1), best(2))
         own(best(1), :) = -1.0_wp
         own(:, best(2)) = -1.0_wp
      end do
      do j = 1, size(after%value)
         if (equal_after(j) > 1) call align(after, j, equal_after(j), product, partner)
      end do
   end subroutine continue_branches

   !> Products (before, after) of the shapes.
   pure function products(before, after) result(product)
      type(spectrum_t), intent(in) :: before, after
      complex(wp), allocatable :: product(:, :)

      complex(wp), allocatable :: image(:, :)
      integer :: i

      if (.not. allocated(after%metric)) then
         product = matmul(conjg(transpose(before%shape)), after%shape)
         return
      end if
      image = matmul(after%metric, before%shape)
      do i = 1, size(image, 2)
         image(:, i) = image(:, i)/sqrt(real(dot_product(before%shape(:, i), image(:, i)), wp))
      end do
      product = matmul(conjg(transpose(image)), after%shape)
   end function products

   !> Turn the shapes of the `n` degenerate modes from `first` on to those that they continue; if these do not span their space, the
   !> shapes stay, and a small likeness tells.
   pure subroutine align(after, first, n, product, partner)
      type(spectrum_t), intent(inout) :: after
      integer, intent(in) :: first, n, partner(:)
      complex(wp), intent(in) :: product(:, :)

      complex(wp), allocatable :: turn(:, :)
      logical :: independent

      associate (own => partner(first:first + n - 1), shape => after%shape(:, first:first + n - 1))
         if (any(own == 0)) return
         turn = conjg(transpose(product(own, first:first + n - 1)))
         call orthonormalise(turn, independent)
         if (independent) shape = matmul(shape, turn)
      end associate
   end subroutine align

   !> Make columns orthonormal one after the other (Gram and Schmidt, twice, because once leaves rounding behind).
   pure subroutine orthonormalise(columns, independent)
      complex(wp), intent(inout) :: columns(:, :)
      logical, intent(out) :: independent

      real(wp) :: length
      integer :: i, j, pass

      independent = .true.
      do i = 1, size(columns, 2)
         do pass = 1, 2
            do j = 1, i - 1
               columns(:, i) = columns(:, i) - dot_product(columns(:, j), columns(:, i))*columns(:, j)
            end do
            length = norm2(abs(columns(:, i)))
            independent = independent .and. length > dependent
            columns(:, i) = columns(:, i)/max(length, dependent)
         end do
      end do
   end subroutine orthonormalise

end module razy_eigen_spectrum
